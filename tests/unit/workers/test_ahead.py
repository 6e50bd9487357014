import threading

import pytest

from workers.ahead import Ahead


def test_work_goes_on_meanwhile_and_its_result_is_given_once() -> None:
    let_go = threading.Event()
    with Ahead[str]("test") as ahead:
        assert ahead.result() is None
        ahead.start(lambda: "done" if let_go.wait(10) else "late")
        let_go.set()  # this thread was not held up
        assert ahead.result() == "done"
        assert ahead.result() is None
        ahead.start(lambda: "again")
        assert ahead.result() == "again"


@pytest.mark.parametrize("error", [KeyError, SystemExit])
def test_what_the_work_raises_is_raised_where_its_result_is_asked_for(error: type[BaseException]) -> None:
    def fail() -> str:
        raise error

    with Ahead[str]("test") as ahead:
        ahead.start(fail)
        with pytest.raises(error):
            ahead.result()
        ahead.start(lambda: "goes on")
        assert ahead.result() == "goes on"
