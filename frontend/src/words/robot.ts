/** The words of the robot, which come with it; the same in English where they cannot be had. */
import { ROBOT } from './en/robot';
import type { Language } from './languages';
import type { In } from './shape';

export type RobotWords = In<typeof ROBOT>;

export async function robotWordsOf(language: Language): Promise<RobotWords> {
  try {
    switch (language) {
      case 'en':
        return ROBOT;
      case 'de':
        return (await import('./de/robot')).ROBOT;
      case 'nl':
        return (await import('./nl/robot')).ROBOT;
      case 'es':
        return (await import('./es/robot')).ROBOT;
    }
  } catch {
    return ROBOT;
  }
}
