/** The current colours of a canvas, by name in the style sheet: light, dark, forced, or for paper. */
export type Colours = (name: string) => string;

export function coloursOf(element: Element): Colours {
  const style = getComputedStyle(element);
  return (name) => style.getPropertyValue(`--${name}`).trim();
}
