import { act } from '../store/app';

export function backToLive(): void {
  act({ type: 'moment', moment: null });
}
