import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "experiments"))  # scripts and what they share, which tests import
