/** Every word of the estimate, in the language that the page speaks. */
import { LANGUAGE } from '../strings';
import { estimateWordsOf } from '../words/estimate';

export const E = await estimateWordsOf(LANGUAGE);
