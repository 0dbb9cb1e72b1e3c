"""Looking up a name and connecting, which asyncio leaves to threads that nobody can interrupt."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor


class LeftAlone(ThreadPoolExecutor):
    """Threads whose work is not waited for at the end.

    A name server that does not answer holds a thread for half a minute, and asyncio waits for all
    of them as it ends. Here it goes on; what is left ends with the process (`lupin_twin.leaving`).
    """

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: ARG002
        """End the idle threads, and wait for none."""
        super().shutdown(wait=False, cancel_futures=True)
