import { useLayoutEffect, type RefObject } from 'react';

/**
 * Where a panel opened from gets the focus back, if it is still somewhere in the panel: asked before
 * that is taken out of the page, and the focus with it.
 */
export function useFocusBack(panel: RefObject<HTMLElement | null>): void {
  useLayoutEffect(() => {
    const element = panel.current;
    const cameFrom = document.activeElement;
    return () => {
      const hadFocus = element?.contains(document.activeElement);
      if (hadFocus && cameFrom instanceof HTMLElement) cameFrom.focus();
    };
  }, [panel]);
}
