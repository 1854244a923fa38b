"""`ab-sim` that distributes even short work over processes."""

from ab_sim.base import workers
from ab_sim.cli import main
from ab_sim.design import work

if __name__ == "__main__":
    workers.TRIAL = workers.WORTH_IT = 0.0
    work.ENOUGH = work.CHUNK_SECONDS = 1e-9
    main()
