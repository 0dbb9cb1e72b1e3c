/** The colours of a canvas, by their names in the style sheet: light or dark, forced, or for paper, as they are now. */
export type Colours = (name: string) => string;

export function coloursOf(element: Element): Colours {
  const style = getComputedStyle(element);
  return (name) => style.getPropertyValue(`--${name}`).trim();
}
