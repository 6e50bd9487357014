"""`hoz-dist` with the tiny table; the processes that it starts import this module, too.

python -m tests.integration.reproduce.tiny reproduce tiny --budget tiny ...
"""

import sys

from hoz_dist.cli.main import run
from hoz_dist.nav.rooms import SPLITS
from hoz_dist.reproduce import measuring
from hoz_dist.reproduce.budget import BUDGETS
from hoz_dist.reproduce.tables import TABLES
from tests.integration.reproduce.tables import FEW_ROOMS, TINY_BUDGET, TINY_TABLE

TABLES["tiny"], BUDGETS["tiny"], SPLITS["bathroom"] = TINY_TABLE, TINY_BUDGET, FEW_ROOMS
measuring.TRAINING_S = 0.2  # type: ignore[misc]  # Final elsewhere

if __name__ == "__main__":
    sys.exit(run(sys.argv[1:]))
