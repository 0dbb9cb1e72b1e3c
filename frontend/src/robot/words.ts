/** Every word of the robot, in the language that the page speaks. */
import { LANGUAGE } from '../strings';
import { robotWordsOf } from '../words/robot';

export const R = await robotWordsOf(LANGUAGE);
