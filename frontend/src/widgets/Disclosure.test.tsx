import { fireEvent, render, screen } from '@testing-library/react';
import { describe, expect, test, vi } from 'vitest';

import { Disclosure, useClose } from './controls';

function Inside(): React.JSX.Element {
  return (
    <button type="button" onClick={useClose()}>
      Done
    </button>
  );
}

const onElsewhere = vi.fn();

const show = (): HTMLElement => {
  onElsewhere.mockClear();
  render(
    <>
      <Disclosure label="Things" button="=" className="things">
        <Inside />
      </Disclosure>
      <button type="button" onClick={onElsewhere}>
        Elsewhere
      </button>
    </>,
  );
  const trigger = screen.getByRole('button', { name: 'Things' });
  fireEvent.click(trigger);
  return trigger;
};
const isOpen = (): boolean => screen.queryByRole('button', { name: 'Done' }) !== null;

describe('disclosure', () => {
  test('opens and closes with its button, and says so', () => {
    const trigger = show();
    expect(isOpen()).toBe(true);
    expect(trigger.getAttribute('aria-expanded')).toBe('true');
    fireEvent.click(trigger);
    expect(isOpen()).toBe(false);
  });

  test('Escape closes it and gives the focus back', () => {
    const trigger = show();
    fireEvent.keyDown(document.body, { key: 'Escape' });
    expect(isOpen()).toBe(false);
    expect(document.activeElement).toBe(trigger);
  });

  test('a press elsewhere, or the focus going elsewhere, closes it', () => {
    show();
    fireEvent.pointerDown(screen.getByRole('button', { name: 'Elsewhere' }));
    expect(isOpen()).toBe(false);
  });

  test('a finger that closes it presses nothing behind it, and one that scrolls leaves it open', () => {
    show();
    const elsewhere = screen.getByRole('button', { name: 'Elsewhere' });
    fireEvent.pointerDown(elsewhere, { pointerType: 'touch' });
    fireEvent.focusIn(elsewhere);
    expect(isOpen()).toBe(true);
    fireEvent.click(elsewhere);
    expect(isOpen()).toBe(false);
    expect(onElsewhere).not.toHaveBeenCalled();
    fireEvent.click(elsewhere);
    expect(onElsewhere).toHaveBeenCalledOnce();
  });

  test('what is inside can close it', () => {
    const trigger = show();
    fireEvent.click(screen.getByRole('button', { name: 'Done' }));
    expect(isOpen()).toBe(false);
    expect(document.activeElement).toBe(trigger);
  });
});
