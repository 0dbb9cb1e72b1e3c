/** De schatting: hoe zeker ze is, hoe goed ze voorspelde, waar nog een meetpunt helpt. */
import type { ESTIMATE as ENGLISH } from '../en/estimate';
import type { In } from '../shape';
import { counted } from './counted';

export const ESTIMATE: In<typeof ENGLISH> = {
  about: 'Wat ± betekent',
  aboutText:
    'Van tien geschatte waarden horen er negen er niet meer dan de ± naast te zitten (een ' +
    '90%-interval). De schatting houdt rekening met hoe ver weg en hoe oud elke meetwaarde is en ' +
    'hoe de kas door de dag gaat: hoe langer niemand meet, hoe groter de ±.',
  onItsWay: 'De schatting komt eraan',
  noService: 'Deze tweeling maakt geen schatting: getoond worden de dichtstbijzijnde waarden',
  noneNow: 'Er is nu geen schatting: getoond worden de dichtstbijzijnde waarden',
  noModel: 'Nog geen schatting: er zijn tien metingen van een sensor nodig',
  noSensor: 'Geen meetpunt meet dit, er valt niets te schatten',
  unsure: (error) =>
    `Gearceerd waar ze er meer dan ±${error} naast kan zitten, hoe dichter hoe meer. Geen kleur: niet bekend`,
  errorOf: (sensor) => `${sensor}: hoe ver de schatting ernaast kan zitten`,
  foretold: (inside, scans) =>
    `${inside} van ${counted(scans, 'meting', 'metingen')} waar de andere meetpunten ze verwachtten`,
  foretoldNone: 'Er is nog geen meting mee vergeleken',
  foretoldDay: (inside, scans) =>
    `Laatste dag: ${inside} van ${counted(scans, 'meting', 'metingen')}`,
  foretoldWeek: (inside, scans) =>
    `laatste week: ${inside} van ${counted(scans, 'meting', 'metingen')}`,
  fitProblem: (reason) => `De kas leren kennen lukt niet goed: ${reason}`,
  notTrusted: (count) =>
    `Vertrouw niet op de ±: maar ${count} van de 10 metingen lagen waar de andere ` +
    'meetpunten ze verwachtten, geen 9.',
  near: (count) =>
    count === 0
      ? 'geen meetpunt in de buurt'
      : counted(count, 'meetpunt in de buurt', 'meetpunten in de buurt'),
  oldest: (age) => `oudste meetwaarde ${age}`,
  expected: (measured, expected) => `gemeten ${measured}, verwacht ${expected}`,
  leftOut: (sensor) => `${sensor} is veranderd: weggelaten uit de schatting`,
  advice: 'Waar nog een meetpunt helpt',
  advised: (place, percent, isFirst) =>
    isFirst
      ? `${place}: een meetpunt hier brengt de fout van de hele kaart naar ${percent} van nu`
      : `${place}: meetpunten hier en bij elke markering ervoor brengen de fout van de hele kaart naar ${percent} van nu`,
  adviceNone: 'Er is geen plek bekend waar nog een meetpunt helpt',
  adviceFailed: (reason) => `Waar nog een meetpunt helpt is niet bekend: ${reason}`,
  adviceNow: 'Waar nog een meetpunt helpt is alleen voor nu bekend',
};
