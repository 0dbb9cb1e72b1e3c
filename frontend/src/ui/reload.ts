/** Longest pause before the reload, and between two questions whether the server answers, ms. */
const PAUSE_MS = 10_000;

/**
 * Reloads a page that has failed, after 5 to 10 s: at random, so that a greenhouse's screens do not all
 * come at once. It waits until the server answers: the browser's own error page would stay for ever.
 */
export function reloadByItself(reload: () => void = reloadNow): () => void {
  const gone = new AbortController();
  const { signal } = gone;
  const attempt = async (): Promise<void> => {
    const url = new URL(window.location.href);
    url.hash = '';
    const answer = await fetch(url, { cache: 'no-store', signal }).catch(() => null);
    if (signal.aborted) return;
    if (answer?.ok) reload();
    else timer = setTimeout(() => void attempt(), PAUSE_MS);
  };
  let timer = setTimeout(() => void attempt(), PAUSE_MS * (0.5 + 0.5 * Math.random()));
  return () => {
    gone.abort();
    clearTimeout(timer);
  };
}

export const reloadNow = (): void => window.location.reload();
