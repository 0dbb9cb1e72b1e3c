/** De robot op de kaart. */
import type { ROBOT as ENGLISH } from '../en/robot';
import type { In } from '../shape';

export const ROBOT: In<typeof ENGLISH> = {
  robotLayer: 'Robot',
  robotAt: (x, y) => `Robot: ${x} m, ${y} m`,
  robotNowhere: 'Robot: plaats niet bekend',
  robotAgeUnknown: 'ouderdom niet bekend',
  robotBattery: (percent) => `accu ${percent}`,
  robotReported: (percent, ago) => `accu ${percent}, ${ago} gemeld`,
};
