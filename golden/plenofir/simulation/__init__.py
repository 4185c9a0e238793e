"""Running the VHDL core on real images and comparing it with the golden model."""

from plenofir.simulation.job import Report, SimulationJob, run_job

__all__ = ["Report", "SimulationJob", "run_job"]
