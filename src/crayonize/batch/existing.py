"""What is done about pictures that are there already."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from .job import Job, Outcome
from .journal import Journal
from .plan import Plan


@dataclass
class Existing:
    """A policy, and what it needs to know."""

    policy: str  # "auto", "skip", "overwrite" or "fail"
    journal: Journal
    # bytes of what stands at a job's target, None if there is nothing
    size: Callable[[Job], int | None]

    def settle(self, job: Job) -> Job | Outcome:
        """The job if it is to be done, or why not."""
        size = self.size(job)
        if size is None or self.policy == "overwrite":
            return job
        if self.policy == "fail":
            return Outcome("failed", "its picture is there already; see --existing")
        if self.policy == "skip" or self.journal.is_done(job, size):
            return Outcome("skipped", "its picture is there already")
        return replace(job, strange=not self.journal.knows(job.out))

    def settle_all(self, plan: Plan) -> list[Job]:
        """The jobs of a plan that are to be done; ValueError if there is a picture and must not
        be.
        """
        to_do = []
        for job in plan.jobs:
            settled = self.settle(job)
            if isinstance(settled, Job):
                to_do.append(settled)
            elif settled.status == "failed":
                raise ValueError(f"a picture is there already, {job.out!r}; see --existing")
            else:
                plan.others.append((job.photo.name, settled))
        return to_do
