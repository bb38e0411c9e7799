"""Studies: a sweep over fields of a mission times seeds, run in processes, one file a run, one tidy CSV.

The only part of the planner that touches files, and only those of the study's own folder. Nothing heavy is imported
here: worker processes set their thread counts before NumPy comes.
"""

from planner.study.load import load_study
from planner.study.record import Claim, Run, Study, StudyError
from planner.study.run import StudyProgress, run_study

__all__ = ["Claim", "Run", "Study", "StudyError", "StudyProgress", "load_study", "run_study"]
