/** Starts what lasts until the returned function is called. */
export function started(start: (signal: AbortSignal) => void): () => void {
  const life = new AbortController();
  start(life.signal);
  return () => life.abort();
}
