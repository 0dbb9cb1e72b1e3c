import { useEffect, useRef, type JSX } from 'react';

import { prefer, useApp } from '../store/app';
import { S } from '../strings';
import { Check, Icon } from '../widgets/controls';

const ID = 'help-dialog';

export function openHelp(): void {
  const dialog = document.getElementById(ID);
  if (dialog instanceof HTMLDialogElement && !dialog.open) dialog.showModal();
}

export function HelpDialog(): JSX.Element {
  const dialog = useRef<HTMLDialogElement>(null);
  const shortcuts = useApp((state) => state.settings.shortcuts);
  // A click on the backdrop is one on the dialog itself, outside its content.
  useEffect(() => {
    const element = dialog.current;
    const onClick = (event: MouseEvent): void => {
      if (event.target === element) element?.close();
    };
    element?.addEventListener('click', onClick);
    return () => {
      element?.removeEventListener('click', onClick);
    };
  }, []);
  return (
    <dialog id={ID} className="help" ref={dialog} aria-labelledby="help-title">
      <div className="help-content">
        <header>
          <h2 id="help-title">{S.help}</h2>
          <form method="dialog">
            <button type="submit" className="icon-button" aria-label={S.cardClose}>
              <Icon name="close" />
            </button>
          </form>
        </header>
        <Keys title={S.helpGlobal} keys={S.keys.global} />
        <Keys title={S.helpTime} keys={S.keys.time} />
        <Keys title={S.helpMap} keys={S.keys.map} />
        <Check
          label={S.helpToggle}
          isOn={shortcuts}
          onChange={(isOn) => {
            prefer({ shortcuts: isOn });
          }}
        />
      </div>
    </dialog>
  );
}

function Keys({
  title,
  keys,
}: {
  title: string;
  keys: readonly (readonly [string, string])[];
}): JSX.Element {
  return (
    <>
      <h3>{title}</h3>
      <dl className="keys">
        {keys.map(([key, action]) => (
          <div key={key}>
            <dt>
              <kbd>{key}</kbd>
            </dt>
            <dd>{action}</dd>
          </div>
        ))}
      </dl>
    </>
  );
}
