import { useMemo, useState } from 'react';

import { inAreas, withHeads, type Line, type Row } from '../domain/table';
import { useApp } from '../store/app';
import { selectAreaOf, selectRows } from '../store/derived';

interface HeldRows {
  /** Rows, and heads of areas between them. */
  readonly lines: readonly Line[];
  readonly onPointerEnter: () => void;
  readonly onPointerLeave: () => void;
}

/** The table's rows. While a pointer or a finger is on them none moves; what is new comes last. */
export function useHeldRows(): HeldRows {
  const rows = useApp(selectRows);
  const areaOf = useApp(selectAreaOf);
  const [held, setHeld] = useState<ReadonlyMap<string, number> | null>(null);
  const lines = useMemo(() => {
    const place = ({ tag }: Row): number => held?.get(tag.id) ?? Infinity;
    const shown = held
      ? [...rows].sort((a, b) => (place(a) === place(b) ? 0 : place(a) - place(b)))
      : rows;
    return areaOf ? withHeads(inAreas(shown, areaOf)) : shown;
  }, [rows, held, areaOf]);
  return {
    lines,
    onPointerEnter: () => {
      setHeld(new Map(rows.map(({ tag }, index) => [tag.id, index])));
    },
    onPointerLeave: () => {
      setHeld(null);
    },
  };
}
