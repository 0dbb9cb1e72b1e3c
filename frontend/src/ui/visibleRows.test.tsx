import { act as settle, fireEvent, render } from '@testing-library/react';
import { Profiler } from 'react';
import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';

import { act, receive, store } from '../store/app';
import { withState } from '../store/twin';
import { withTag } from '../store/view';
import { nextStamp, showTags } from '../testing/page';
import { readings, stateFrame, wireTag } from '../testing/tags';
import { TagTable } from './TagTable';
import { LONGEST_ON_PAPER, partsOf, rangeInSight, SHORT_TABLE } from './visibleRows';

const house = (count: number): ReturnType<typeof wireTag>[] =>
  Array.from({ length: count }, (_, index) =>
    wireTag({ tag_id: String(index + 1), readings: readings({ temperature: 20 }) }),
  );
const rows = (): HTMLElement[] => [...document.querySelectorAll<HTMLElement>('tr[data-tag-id]')];
const indices = (): number[] => rows().map((row) => Number(row.getAttribute('aria-rowindex')));

describe('parts of a table', () => {
  const text = (...args: Parameters<typeof partsOf>): string =>
    partsOf(...args)
      .map((part) => (part.kind === 'gap' ? `(${part.rows})` : part.index))
      .join(' ');

  test('are the rows of the range, and what is left out around them', () => {
    expect(text(10, { from: 3, to: 6 }, [])).toBe('(3) 3 4 5 (4)');
    expect(text(3, { from: 0, to: 3 }, [])).toBe('0 1 2');
    expect(text(0, { from: 0, to: 40 }, [])).toBe('');
    expect(text(4, { from: 2, to: 40 }, [])).toBe('(2) 2 3');
  });

  test('a range beyond the end of a table that a filter made short is empty', () => {
    expect(text(4, { from: 80, to: 120 }, [])).toBe('(4)');
  });

  test('single rows stand where they belong, once', () => {
    expect(text(10, { from: 3, to: 5 }, [8, 0, 8, 4])).toBe('0 (2) 3 4 (3) 8 (1)');
    expect(text(10, { from: 3, to: 5 }, [-1, 10, NaN])).toBe('(3) 3 4 (5)');
  });
});

test('the range in sight holds every row of the window, and follows the scrolling', () => {
  for (const top of [0, -10, -444, -44_444]) {
    const { from, to } = rangeInSight(top, 45, 900);
    expect(from).toBeLessThanOrEqual(Math.max(0, -top / 45));
    expect(to).toBeGreaterThanOrEqual((900 - top) / 45);
    expect(to - from).toBeLessThan(70);
  }
  // Far below the window: spare rows only.
  expect(rangeInSight(5_000, 45, 900).to).toBe(0);
});

describe('a long table', () => {
  afterEach(() => {
    vi.useRealTimers();
  });

  let commits = 0;
  const show = (count: number): void => {
    showTags(house(count));
    commits = 0;
    render(
      <Profiler
        id="table"
        onRender={() => {
          commits += 1;
        }}
      >
        <TagTable />
      </Profiler>,
    );
  };
  const receiveState = (wires: readonly ReturnType<typeof wireTag>[], sec: number): void => {
    settle(() => {
      receive(withState(stateFrame(wires, { sec, revision: `r${sec}` }), performance.now()));
    });
  };

  beforeEach(() => {
    commits = 0;
  });

  test('up to its length has all rows in the page, and one more has not', () => {
    show(SHORT_TABLE);
    expect(rows()).toHaveLength(SHORT_TABLE);
    receiveState(house(SHORT_TABLE + 1), 50_000);
    expect(rows().length).toBeLessThan(70);
  });

  test('of 10,000 tags has the rows in sight, and tells which of how many they are', () => {
    show(10_000);
    expect(rows().length).toBeLessThan(70);
    expect(document.querySelector('table')?.getAttribute('aria-rowcount')).toBe('10001');
    expect(indices().slice(0, 3)).toEqual([2, 3, 4]);
    const gap = document.querySelector<HTMLElement>('tr.gap');
    expect(gap?.getAttribute('aria-hidden')).toBe('true');
    expect(gap?.style.height).toBe(`${(10_000 - rows().length) * 45}px`);
  });

  test('has the chosen row wherever it is, and the one with the focus as long as it has it', () => {
    show(10_000);
    settle(() => {
      act(withTag('7777'));
    });
    expect(indices().at(-1)).toBe(7778);
    const button = rows().at(-1)?.querySelector('button');
    settle(() => button?.focus());
    settle(() => {
      act(withTag(null));
    });
    // With its neighbours, so that Tab can pass an area heading.
    expect(indices().slice(-5)).toEqual([7776, 7777, 7778, 7779, 7780]);
    expect(document.activeElement).toBe(button);
    settle(() => button?.blur());
    expect(indices().at(-1)).toBeLessThan(70);
  });

  test('on paper has all rows, or as many as paper can take', () => {
    show(LONGEST_ON_PAPER);
    // As `window.print` does in a script, which must not wait for React.
    window.dispatchEvent(new Event('beforeprint'));
    expect(rows()).toHaveLength(LONGEST_ON_PAPER);
    receiveState(house(LONGEST_ON_PAPER + 1), 60_000);
    expect(rows()).toHaveLength(LONGEST_ON_PAPER);
    fireEvent(window, new Event('afterprint'));
    expect(rows().length).toBeLessThan(70);
  });

  test('a heartbeat that changes nothing renders nothing; one scan renders its own row', () => {
    // On a busy machine, a second could pass in between and change the ages.
    vi.useFakeTimers({ toFake: ['performance', 'setInterval', 'clearInterval'] });
    show(1_000);
    const before = commits;
    receiveState(house(1_000), nextStamp());
    expect(commits).toBe(before);

    // Only a row reads this property, once per render.
    const rendered: string[] = [];
    for (const tag of store.get().twin.latest.snapshot?.tags ?? []) {
      const confidence = tag.speciesConfidence;
      Object.defineProperty(tag, 'species', { value: 'lupin' });
      Object.defineProperty(tag, 'speciesConfidence', {
        get: () => {
          rendered.push(tag.id);
          return confidence;
        },
      });
    }
    const changed = house(1_000);
    changed[2] = wireTag({ tag_id: '3', readings: readings({ temperature: 31 }) });
    receiveState(changed, nextStamp() + 1);
    expect(document.querySelector('tr[data-tag-id="3"]')?.textContent).toContain('31.0');
    expect(rendered).toEqual([]);
  });
});
