/** Der Roboter auf der Karte. */
import type { ROBOT as ENGLISH } from '../en/robot';
import type { In } from '../shape';

export const ROBOT: In<typeof ENGLISH> = {
  robotLayer: 'Roboter',
  robotAt: (x, y) => `Roboter: ${x} m, ${y} m`,
  robotNowhere: 'Roboter: Position unbekannt',
  robotAgeUnknown: 'Alter unbekannt',
  robotBattery: (percent) => `Akku ${percent}`,
  robotReported: (percent, ago) => `Akku ${percent}, gemeldet ${ago}`,
};
