import { cleanup, fireEvent, render, screen } from '@testing-library/react';
import { beforeEach, describe, expect, test, vi, type Mock } from 'vitest';

import { Bound } from './RangeControl';
import { sensorNamed } from '../testing/sensors';

let onChange: Mock<(value: number) => void>;

beforeEach(() => {
  onChange = vi.fn<(value: number) => void>();
  render(
    <Bound
      label="Lowest"
      sensor={sensorNamed('temperature', 'F')}
      value={10}
      refusal={(value) => (value < 30 ? null : 'too high')}
      onChange={onChange}
    />,
  );
});

const field = (): HTMLInputElement => screen.getByLabelText('Lowest °F');
const type = (value: string): void => {
  fireEvent.change(field(), { target: { value } });
};

describe('one end of a fixed range', () => {
  test('shows what is in force, and takes what is typed on leaving', () => {
    expect(field().value).toBe('50');
    type('68');
    expect(onChange).not.toHaveBeenCalled();
    fireEvent.blur(field());
    expect(onChange).toHaveBeenCalledExactlyOnceWith(20);
  });

  test('a limit of a sensor with small values has all its digits', () => {
    cleanup();
    const spin = sensorNamed('spin');
    render(
      <Bound label="Most" sensor={spin} value={0.0045} refusal={() => null} onChange={onChange} />,
    );
    expect(screen.getByLabelText<HTMLInputElement>('Most').value).toBe('0.0045');
  });

  test('takes it with Enter, once', () => {
    type('68');
    fireEvent.keyDown(field(), { key: 'Enter' });
    fireEvent.blur(field());
    expect(onChange).toHaveBeenCalledTimes(1);
  });

  test('passing through changes nothing, not even by rounding', () => {
    fireEvent.focus(field());
    fireEvent.blur(field());
    // Typed back to the applied value: nothing has changed.
    type('5');
    type('50');
    fireEvent.blur(field());
    expect(onChange).not.toHaveBeenCalled();
  });

  test.each([
    ['99', 'too high'],
    ['', 'Not a number: not applied'],
  ])('“%s” says why it is not in use, and gives way on leaving', (text, why) => {
    type(text);
    expect(field().getAttribute('aria-invalid')).toBe('true');
    const reason = screen.getByRole('alert');
    expect(reason.textContent).toBe(why);
    expect(field().getAttribute('aria-describedby')).toBe(reason.id);
    fireEvent.keyDown(field(), { key: 'Enter' });
    expect(field().value).toBe(text);
    fireEvent.blur(field());
    expect(field().value).toBe('50');
    expect(field().getAttribute('aria-invalid')).toBe('false');
    expect(screen.queryByRole('alert')).toBeNull();
    expect(onChange).not.toHaveBeenCalled();
  });

  test('Escape goes back to what is in force, and then belongs to the page again', () => {
    type('99');
    // false: the default was prevented.
    expect(fireEvent.keyDown(field(), { key: 'Escape' })).toBe(false);
    expect(field().value).toBe('50');
    expect(fireEvent.keyDown(field(), { key: 'Escape' })).toBe(true);
  });
});
