from hoz_dist.errors import HozError, UnknownNameError


def test_an_unknown_name_gets_the_nearest_known_one() -> None:
    error = UnknownNameError.of("scene", "Kitchn", ["kitchen", "bedroom"])
    assert str(error) == "Unknown scene 'Kitchn'. Did you mean 'kitchen'? Known: kitchen, bedroom."
    assert isinstance(error, HozError)


def test_a_name_like_no_other_gets_no_guess() -> None:
    assert str(UnknownNameError.of("scene", "zzz", ["kitchen"])) == "Unknown scene 'zzz'. Known: kitchen."
