/** What buttons and keys ask of the map, wherever in the page they are. */
export type MapCommand =
  | { readonly type: 'fit' }
  | { readonly type: 'zoom'; readonly factor: number }
  /** Share of the view's size to move by; x to the right, y down. */
  | { readonly type: 'pan'; readonly x: number; readonly y: number }
  /** Brings a tag's pin into view. */
  | { readonly type: 'show'; readonly tagId: string }
  /** Shows the layers as on paper, without what moves or follows the pointer, while `take` runs. */
  | { readonly type: 'picture'; readonly take: () => void };

type Listener = (command: MapCommand) => void;

const listeners = new Set<Listener>();

export function onMapCommand(listener: Listener): () => void {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

export function commandMap(command: MapCommand): void {
  for (const listener of [...listeners]) listener(command);
}
