"""The paper's tables, made again: what their rows are, which runs they take, and what the results say.

From the question to the answer: `row` and `tables` (what is compared), `budget` (how long), `job` (one row with one
seed, and where its results are kept), `costs` and `measuring` (how long that takes), `outcome` (results of episodes),
`bootstrap` and `summary` (what they say), `markdown` and `plot`. Processes are started by `hoz_dist.cli` alone.
"""
