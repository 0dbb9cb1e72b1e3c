import { useMemo, useState } from 'react';

import type { Row } from '../domain/table';
import { useApp } from '../store/app';
import { selectRows } from '../store/derived';

interface HeldRows {
  readonly rows: readonly Row[];
  readonly onPointerEnter: () => void;
  readonly onPointerLeave: () => void;
}

/** The table's rows. While a pointer or a finger is on them none moves; what is new comes last. */
export function useHeldRows(): HeldRows {
  const rows = useApp(selectRows);
  const [held, setHeld] = useState<ReadonlyMap<string, number> | null>(null);
  const shown = useMemo(() => {
    if (!held) return rows;
    const place = ({ tag }: Row): number => held.get(tag.id) ?? Infinity;
    return [...rows].sort((a, b) => (place(a) === place(b) ? 0 : place(a) - place(b)));
  }, [rows, held]);
  return {
    rows: shown,
    onPointerEnter: () => {
      setHeld(new Map(rows.map(({ tag }, index) => [tag.id, index])));
    },
    onPointerLeave: () => {
      setHeld(null);
    },
  };
}
