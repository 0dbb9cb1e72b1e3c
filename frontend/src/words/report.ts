/** The words for the shift report, which come with its button; its own are the bridge's. */
import type { Language } from './languages';

export const REPORT: Record<Language, string> = {
  en: 'Shift report',
  de: 'Schichtbericht',
  nl: 'Dienstrapport',
  es: 'Informe de turno',
};
