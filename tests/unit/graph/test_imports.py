import subprocess
import sys


def test_planning_imports_neither_learning_library_nor_simulator_nor_scipy() -> None:
    script = (
        "import sys; import hoz_dist.graph.files, hoz_dist.graph.planner, hoz_dist.graph.zones;"
        "print(*{name.partition('.')[0] for name in sys.modules}"
        " & {'torch', 'pybullet', 'gymnasium', 'sklearn', 'scipy', 'matplotlib', 'zenoh'})"
    )
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert result.stdout.split() == []
