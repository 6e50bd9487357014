import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hoz_dist.errors import HozError, InvalidValueError
from hoz_dist.nav.categories import TARGETS
from hoz_dist.policy.relations import check_relations, read_relations, relation_matrix, shipped_relations


def written(folder: Path, content: Any) -> Path:
    path = folder / "relations.json"
    path.write_text(json.dumps(content))
    return path


def test_a_pair_is_related_when_one_relation_is_counted_three_times(tmp_path: Path) -> None:
    rows = [
        ["Plate", "near", "Bowl", 2],
        ["Bowl", "near", "Plate", 1],
        ["Book", "on", "Chair", 2],
        ["Book", "near", "Chair", 2],
        ["Fridge", "near", "Fridge", 9],
        ["Fridge", "near", "Sofa", 9],
    ]
    assert read_relations(written(tmp_path, rows)) == ("Bowl+Plate",)


def test_visual_genomes_own_form_is_read_and_its_names_are_mapped(tmp_path: Path) -> None:
    def says(subject: dict[str, Any], predicate: str, thing: dict[str, Any]) -> dict[str, Any]:
        return {"relationship_id": 1, "predicate": predicate, "subject": subject, "object": thing, "synsets": []}

    tv, remote = {"name": "TV", "object_id": 1}, {"names": ["remote  controls"], "h": 3}
    images = [
        {"image_id": 1, "relationships": [says(tv, "NEAR", remote), says(remote, "near", tv)]},
        {"image_id": 2, "relationships": [says({"name": "man"}, "on", tv), says(remote, "Near", tv)]},
        {"image_id": 3, "relationships": []},
    ]
    assert read_relations(written(tmp_path, images)) == ("RemoteControl+Television",)


@pytest.mark.parametrize(
    "content",
    [
        {"a": 1},
        [1],
        ["abc"],
        [["Bowl", "near", "Plate"]],
        [["Bowl", "near", "Plate", "many"]],
        [{"image_id": 1}],
        [{"relationships": [{"subject": {"name": "tv"}}]}],
        [["Bowl", "near", "Plate", 2]],
        [],
    ],
)
def test_what_holds_no_relations_is_refused_in_one_sentence(content: Any, tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError) as caught:
        read_relations(written(tmp_path, content))
    assert str(caught.value).endswith(".")


def test_a_file_that_is_missing_or_no_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(HozError, match="cannot be read"):
        read_relations(tmp_path / "none.json")
    (tmp_path / "relations.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InvalidValueError):
        read_relations(tmp_path / "relations.json")


def test_the_shipped_relations_are_a_sparse_graph_of_what_stands_together() -> None:
    shipped = shipped_relations()
    check_relations(shipped)
    assert {"Pan+StoveBurner", "AlarmClock+DeskLamp", "Chair+Laptop"} <= set(shipped)
    assert "AlarmClock+Sink" not in shipped
    assert 20 < len(shipped) < 80


@pytest.mark.parametrize("relation", ["Bowl", "Plate+Bowl", "Bowl+Bowl", "Bowl+Sofa", ""])
def test_what_is_no_pair_is_refused(relation: str) -> None:
    with pytest.raises(InvalidValueError):
        check_relations([relation])


def test_the_matrix_is_symmetric_with_ones_on_the_diagonal() -> None:
    matrix = relation_matrix(["Bowl+Plate"])
    expected = np.eye(len(TARGETS))
    bowl, plate = TARGETS.index("Bowl"), TARGETS.index("Plate")
    expected[bowl, plate] = expected[plate, bowl] = 1.0
    np.testing.assert_array_equal(matrix, expected)
