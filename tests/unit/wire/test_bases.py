"""What a learner serves to readers of deltas, one of whom follows here without a network."""

import numpy as np
import pytest

from hoz_dist.wire.client.download import Base, Download, base_of
from hoz_dist.wire.protocol.parameters import NO_BASE, ParametersHead
from hoz_dist.wire.serving.bases import LONGEST_LIFE, Bases
from hoz_dist.wire.serving.editions import Delta, Edition, Full
from hoz_dist.wire.transport.buffers import Buffers

SIZE = 300
TRAINING = np.random.default_rng(3).normal(scale=1e-3, size=(5 * LONGEST_LIFE, SIZE)).cumsum(axis=0, dtype=np.float32)
"""Parameters that every update moves by about 0.001, by version."""


def trained(version: int, epoch: int = 1) -> Full:
    return Full(ParametersHead(epoch, version, SIZE), TRAINING[version])


class Reader:
    """One that reads what it gets at once."""

    def __init__(self, bases: Bases) -> None:
        self._bases = bases
        self._base: Base | None = None
        self.read: list[Edition] = []
        """What it has got so far."""

    def fetch(self, newest: Full) -> np.ndarray:
        """The newest version, as it comes to the reader, once it is published."""
        self._bases.publish(newest)
        for _ in range(4):
            edition = self._bases.next_for(NO_BASE if self._base is None else self._base.digest)
            assert edition is not None
            if isinstance(edition, ParametersHead):
                assert self._base is not None
                assert edition.stamp == newest.head.stamp
                return self._base.parameters.vector
            self.read.append(edition)
            download = Download(Buffers(), self._base)
            for number in range(edition.shards):
                assert download.add(edition.part(number))
            parameters = download.result()
            assert parameters is not None
            if download.renews:
                self._base = base_of(parameters)
            else:
                return parameters.vector
        pytest.fail("it takes too many steps")


@pytest.fixture
def bases() -> Bases:
    return Bases(Buffers())


def test_the_first_reader_gets_a_base_that_is_the_newest_version_to_the_bit(bases: Bases) -> None:
    reader = Reader(bases)
    newest = trained(40)
    assert reader.fetch(newest) is not newest.vector
    np.testing.assert_array_equal(reader.fetch(newest), newest.vector)
    assert reader.read == [newest]


def test_errors_do_not_add_up_and_only_the_first_base_comes_in_full(bases: Bases) -> None:
    reader = Reader(bases)
    for version in range(0, 5 * LONGEST_LIFE, 60):
        newest = trained(version)
        # What moved since the base, over 254; here a base lasts at most 60 versions longer than its time.
        most = 5 * 1e-3 * np.sqrt(LONGEST_LIFE + 60) / 254
        assert np.abs(reader.fetch(newest) - newest.vector).max() < most
    assert [type(edition) for edition in reader.read[:2]] == [Full, Delta]
    assert sum(isinstance(edition, Full) for edition in reader.read) == 1
    renewed = [edition.head.version for edition in reader.read if isinstance(edition, Delta) and edition.renews]
    assert renewed == [300, 540, 780, 1080]


def test_a_version_is_quantised_once_for_all(bases: Bases) -> None:
    first, second = Reader(bases), Reader(bases)
    for version in (3, 5, 300):
        for reader in (first, second):
            reader.fetch(trained(version))
    assert first.read[-1] is second.read[-1]
    assert len(first.read) == len(second.read) == 3


def test_one_that_missed_a_new_base_gets_there_by_a_delta(bases: Bases) -> None:
    busy, lazy = Reader(bases), Reader(bases)
    for reader in (busy, lazy):
        reader.fetch(trained(1))
    for version in (2, 260, 270):
        busy.fetch(trained(version))
    np.testing.assert_array_equal(lazy.fetch(trained(270)), busy.fetch(trained(270)))
    assert [edition.head.version for edition in lazy.read] == [1, 260, 270]
    assert isinstance(lazy.read[1], Delta)


def test_one_that_missed_two_begins_with_a_base_in_full(bases: Bases) -> None:
    busy, lazy = Reader(bases), Reader(bases)
    for reader in (busy, lazy):
        reader.fetch(trained(1))
    for version in (260, 520, 530):
        busy.fetch(trained(version))
    np.testing.assert_array_equal(lazy.fetch(trained(530)), busy.fetch(trained(530)))
    assert [(type(edition), edition.head.version) for edition in lazy.read[1:]] == [(Full, 520), (Delta, 530)]


def test_a_new_epoch_or_another_run_begins_with_a_base_in_full(bases: Bases) -> None:
    reader = Reader(bases)
    for newest in (trained(5), trained(9), trained(9, epoch=2), trained(3, epoch=2)):
        made = reader.fetch(newest)
        np.testing.assert_allclose(made, newest.vector, atol=1e-3)
    assert [type(edition) for edition in reader.read] == [Full, Delta, Full, Full]


def test_what_is_kept_is_bounded(bases: Bases) -> None:
    reader = Reader(bases)
    for version in range(0, 3 * LONGEST_LIFE, 50):
        reader.fetch(trained(version))
        assert sum(edition.nbytes for edition in bases.kept) < (4 + 1.1 + 1.1) * SIZE


def test_what_a_reader_makes_of_a_version_does_not_depend_on_when_anybody_asks() -> None:
    made = []
    for asked in ((0, 255, 256, 300, 700), (0, 3, 300, 301, 511, 520, 700)):
        bases = Bases(Buffers())
        reader = Reader(bases)
        of_version = {}
        for version in range(701):
            bases.publish(trained(version))
            if version in asked:
                of_version[version] = reader.fetch(trained(version)).tobytes()
        made.append(of_version)
    for version in (300, 700):
        assert made[0][version] == made[1][version]
