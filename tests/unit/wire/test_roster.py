"""Who is listed as live and as left, whatever the order in which tokens come and go."""

from hoz_dist.wire.membership.roster import MOST_LEFT, MOST_LIVE, MOST_OF_NAME, Member, Roster

ANNA = Member("actor", "anna", "h1", 1)
AGAIN = Member("actor", "anna", "h2", 2)
"""The same actor, started again, elsewhere."""


def left(roster: Roster) -> list[Member]:
    return [departure.member for departure in roster.left()]


def test_who_left_is_listed_with_the_time_the_last_one_first() -> None:
    roster = Roster()
    ben = Member("actor", "ben", "h1", 5)
    for member in (ben, ANNA):
        assert roster.join(member)
    assert roster.live() == (ANNA, ben)
    assert roster.leave(ANNA, 3.0)
    assert roster.leave(ben, 4.0)
    assert roster.live() == ()
    assert roster.left() == ((ben, 4.0), (ANNA, 3.0))


def test_who_came_back_is_not_listed_as_left() -> None:
    for back in (ANNA, AGAIN):
        roster = Roster()
        roster.join(ANNA)
        roster.leave(ANNA, 3.0)
        roster.join(back)
        assert (roster.live(), left(roster)) == ((back,), [])


def test_an_actor_that_is_back_before_its_old_token_went_has_not_left() -> None:
    roster = Roster()
    for member in (ANNA, AGAIN):
        roster.join(member)
    roster.leave(ANNA, 3.0)
    assert (roster.live(), left(roster)) == ((AGAIN,), [])
    roster.leave(AGAIN, 4.0)
    assert left(roster) == [AGAIN]


def test_an_actor_that_keeps_failing_is_listed_once() -> None:
    roster = Roster()
    for incarnation in range(10):
        roster.join(Member("actor", "anna", "h1", incarnation))
        roster.leave(Member("actor", "anna", "h1", incarnation), float(incarnation))
    assert left(roster) == [Member("actor", "anna", "h1", 9)]


def test_a_leader_that_was_killed_is_listed_though_its_standby_has_the_same_name() -> None:
    leader, standby = Member("learner", "h1", "h1", 1), Member("standby", "h1", "h1", 2)
    heir, again = Member("learner", "h1", "h1", 2), Member("standby", "h1", "h1", 3)
    for takes_over in ((heir,), (standby, heir)):
        roster = Roster()
        for member in (leader, standby):
            roster.join(member)
        roster.leave(leader, 3.0)
        if takes_over[0] == standby:  # its new token may come before or after its old one goes
            roster.join(heir)
            roster.leave(standby, 3.1)
        else:
            roster.leave(standby, 3.1)
            roster.join(heir)
        assert (roster.live(), left(roster)) == ((heir,), [leader])
        roster.join(again)
        assert (roster.live(), left(roster)) == ((heir, again), [])


def test_an_actor_and_a_learner_of_one_name_are_not_taken_for_each_other() -> None:
    roster = Roster()
    learner = Member("learner", "anna", "h1", 1)
    roster.join(ANNA)
    roster.leave(ANNA, 3.0)
    roster.join(learner)
    assert (roster.live(), left(roster)) == ((learner,), [ANNA])


def test_a_token_that_is_told_again_or_goes_unknown_changes_nothing() -> None:
    roster = Roster()
    assert roster.join(ANNA)
    assert roster.join(ANNA)
    assert not roster.leave(AGAIN, 3.0)
    assert roster.leave(ANNA, 4.0)
    assert not roster.leave(ANNA, 5.0)
    assert (roster.live(), roster.left()) == ((), ((ANNA, 4.0),))


def test_invented_tokens_do_not_fill_the_memory_and_do_not_hide_the_leader() -> None:
    roster = Roster()
    flood = [Member("actor", f"x{number}", "h", number) for number in range(MOST_LIVE["actor"] + 100)]
    taken = [roster.join(member) for member in flood]
    assert taken == [True] * MOST_LIVE["actor"] + [False] * 100
    assert not roster.join(Member("king", "x", "h", 1))
    leader = Member("learner", "l0", "h1", 1)
    assert roster.join(leader)
    for member in flood:
        roster.leave(member, 1.0)
    assert roster.live() == (leader,)
    assert len(roster.left()) == MOST_LEFT
    assert roster.join(ANNA)


def test_one_name_cannot_crowd_out_the_others() -> None:
    roster = Roster()
    taken = [roster.join(Member("actor", "x", "h", number)) for number in range(2000)]
    assert sum(taken) == MOST_OF_NAME
    assert roster.join(ANNA)
