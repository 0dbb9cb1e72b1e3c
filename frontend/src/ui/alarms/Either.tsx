import type { JSX } from 'react';

/** One of two texts, as wide as the wider: nothing beside it moves when it is the other. */
export function Either({
  texts,
  at,
}: {
  texts: readonly [string, string];
  at: 0 | 1;
}): JSX.Element {
  return (
    <span className="either">
      {texts.map((text, index) => (
        <span key={text} data-hidden={index !== at}>
          {text}
        </span>
      ))}
    </span>
  );
}
