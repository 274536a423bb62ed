"""Wrong tokens make their address wait, twice as long each time."""

from reviewer.app.door.attempts import FORGOTTEN_S, MOST_ADDRESSES, Attempts


class Clock:
    now = 1000.0

    def __call__(self):
        return self.now


def test_three_are_free_then_the_wait_doubles_up_to_a_minute():
    clock = Clock()
    attempts = Attempts(clock)
    waits = []
    for _ in range(12):
        attempts.fail("a")
        waits.append(attempts.wait_s("a"))
        clock.now += waits[-1]
        assert attempts.wait_s("a") == 0
    assert waits == [0, 0, 1, 2, 4, 8, 16, 32, 60, 60, 60, 60]
    assert attempts.wait_s("b") == 0


def test_a_right_token_and_time_make_it_forgotten():
    clock = Clock()
    attempts = Attempts(clock)
    for _ in range(8):
        attempts.fail("a")
        attempts.fail("b")
    attempts.succeed("a")
    assert attempts.wait_s("a") == 0 and attempts.fail("a") == 1
    clock.now += FORGOTTEN_S + 1
    assert attempts.fail("b") == 1


def test_many_addresses_are_not_kept_for_ever():
    attempts = Attempts(Clock())
    for number in range(MOST_ADDRESSES + 5):
        attempts.fail(str(number))
    assert len(attempts._failures) == MOST_ADDRESSES
