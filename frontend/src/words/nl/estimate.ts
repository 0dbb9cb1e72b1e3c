/** De schatting: hoe zeker ze is, hoe goed ze voorspelde, waar nog een meetpunt helpt. */
import type { ESTIMATE as ENGLISH } from '../en/estimate';
import type { In } from '../shape';
import { counted, whole } from './counted';

export const ESTIMATE: In<typeof ENGLISH> = {
  about: 'Wat ± betekent',
  aboutText:
    'In negen van de tien gevallen is de fout naar verwachting niet groter dan de ± (90%-interval). ' +
    'Die hangt af van hoe ver weg en hoe oud de metingen zijn, en van het tijdstip. ' +
    'Hoe langer er niet wordt gemeten, hoe groter de ±.',
  onItsWay: 'De schatting wordt geladen',
  noneNow: 'Er is nu geen schatting: u ziet de dichtstbijzijnde waarden',
  computed: 'Van een berekende waarde is er geen schatting: u ziet de dichtstbijzijnde waarden',
  noModel: 'Nog geen schatting: er zijn tien metingen van een sensor nodig',
  unsure: (error) => `Gearceerde kleur: minder zeker dan ±${error}. Geen kleur: geen gegevens`,
  error: 'Onzekerheid van de schatting',
  predicted: (inside, scans) =>
    `${whole(inside)} van ${counted(scans, 'meting', 'metingen')} binnen het voorspelde bereik`,
  predictedNone: 'Er is nog geen meting mee vergeleken',
  fitProblem: (reason) => `Het model past niet goed bij deze kas: ${reason}`,
  notTrusted: (count) =>
    `Foutmarge te krap: slechts ${count} van de 10 metingen vielen erbinnen, in plaats van 9.`,
  near: (count) =>
    count === 0
      ? 'geen meetpunt in de buurt'
      : counted(count, 'meetpunt in de buurt', 'meetpunten in de buurt'),
  oldest: (age) => `oudste meetwaarde ${age} geleden`,
  expected: (measured, expected) => `gemeten ${measured}, verwacht ${expected}`,
  leftOut: (sensor) => `${sensor}: mogelijke sensorfout, niet in de schatting gebruikt`,
  advised: (place, percent, isFirst) =>
    isFirst
      ? `${place}: een meetpunt hier verlaagt de fout van de kaart tot ${percent} van de huidige`
      : `${place}: meetpunten hier en bij elke markering ervoor verlagen de fout van de kaart tot ${percent} van de huidige`,
  adviceNone: 'Geen voorstel voor een extra meetpunt',
  adviceFailed: (reason) => `Geen voorstel voor een extra meetpunt: ${reason}`,
  adviceNow: 'Voorstellen voor een extra meetpunt zijn er alleen voor nu',
};
