import type { ComponentProps, JSX } from 'react';

import { Icon, type IconName } from './Icon';

interface Props extends ComponentProps<'button'> {
  readonly icon: IconName;
  readonly label: string;
}

/** A button that is a picture, with its word for who does not see it. */
export const IconButton = ({ icon, label, ...rest }: Props): JSX.Element => (
  <button type="button" className="icon-button" aria-label={label} title={label} {...rest}>
    <Icon name={icon} />
  </button>
);
