"""A sweep in a process of its own, which tests kill: folder, values, number of processes."""

import pickle
import runpy
import sys
from functools import partial
from pathlib import Path

from asperity.sweeps.run_sweep import local_place, run_plan
from asperity.sweeps.sweep_plan import make_plan

COUNTING = str(Path(__file__).with_name("counting_run.py"))

if __name__ == "__main__":
    folder, values, processes = sys.argv[1:]
    runpy.run_path(COUNTING)
    prepare = pickle.dumps(partial(runpy.run_path, COUNTING))
    vary = {"texture.period": values}
    plan = make_plan("sinusoid:amplitude=0.1mm", vary, "counting", prepare=prepare)
    place = local_place(int(processes))
    run_plan(plan, place, Path(folder)).to_csv(Path(folder) / "table.csv")
