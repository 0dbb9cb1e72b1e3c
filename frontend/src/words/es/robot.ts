/** El robot en el mapa. */
import type { ROBOT as ENGLISH } from '../en/robot';
import type { In } from '../shape';

export const ROBOT: In<typeof ENGLISH> = {
  robotLayer: 'Robot',
  robotAt: (x, y) => `Robot: ${x} m, ${y} m`,
  robotNowhere: 'Robot: no se sabe dónde está',
  robotAgeUnknown: 'antigüedad desconocida',
  robotBattery: (percent) => `batería ${percent}`,
  robotReported: (percent, ago) => `batería ${percent}, comunicado ${ago}`,
};
