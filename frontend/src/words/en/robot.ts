/** The robot on the map. */

export const ROBOT = {
  robotLayer: 'Robot',
  robotAt: (x: string, y: string): string => `Robot: ${x} m, ${y} m`,
  robotNowhere: 'Robot: position unknown',
  robotAgeUnknown: 'age unknown',
  robotBattery: (percent: string): string => `battery ${percent}`,
  robotReported: (percent: string, ago: string): string => `battery ${percent}, reported ${ago}`,
};
