import type { JSX } from 'react';

/** What only who looks after the machines needs to read, behind a word that opens it. */
export function More({ label, text }: { label: string; text: string }): JSX.Element | null {
  if (text === '') return null;
  return (
    <details className="more">
      <summary>{label}</summary>
      {text}
    </details>
  );
}
