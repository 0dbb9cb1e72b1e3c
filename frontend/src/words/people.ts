/** The words about people, which come with what shows them; few, so all languages in one place. */
import type { Language } from './languages';

export const PEOPLE = {
  en: {
    shared: (name: string): string =>
      `Signed in as ${name}: everybody sees what you acknowledge or shelve.`,
    reads: (name: string): string =>
      `Signed in as ${name} (viewer): what you acknowledge or shelve stays in this browser.`,
    elsewhere: (name: string): string =>
      `Signed in as ${name}: this server stores no notes, so what you acknowledge or shelve stays in this browser.`,
    acknowledged: (name: string, at: string): string => `acknowledged by ${name} at ${at}`,
    failed: (why: string): string => `Not saved: ${why}`,
  },
  de: {
    shared: (name: string): string =>
      `Angemeldet als ${name}: Was Sie quittieren oder zurückstellen, sehen alle.`,
    reads: (name: string): string =>
      `Angemeldet als ${name}, nur lesend: Was Sie quittieren oder zurückstellen, bleibt in diesem Browser.`,
    elsewhere: (name: string): string =>
      `Angemeldet als ${name}: Dieser Server speichert keine Notizen. Was Sie quittieren oder zurückstellen, bleibt in diesem Browser.`,
    acknowledged: (name: string, at: string): string => `quittiert von ${name} um ${at}`,
    failed: (why: string): string => `Nicht gespeichert: ${why}`,
  },
  nl: {
    shared: (name: string): string =>
      `Aangemeld als ${name}: wat u bevestigt of uitstelt, ziet iedereen.`,
    reads: (name: string): string =>
      `Aangemeld als ${name} (alleen lezen): wat u bevestigt of uitstelt, blijft in deze browser.`,
    elsewhere: (name: string): string =>
      `Aangemeld als ${name}: deze server slaat geen notities op; wat u bevestigt of uitstelt, blijft in deze browser.`,
    acknowledged: (name: string, at: string): string => `bevestigd door ${name} om ${at}`,
    failed: (why: string): string => `Niet opgeslagen: ${why}`,
  },
  es: {
    shared: (name: string): string =>
      `Sesión iniciada como ${name}: todos ven lo que usted reconoce o aplaza.`,
    reads: (name: string): string =>
      `Sesión iniciada como ${name}, solo lectura: lo que reconoce o aplaza queda en este navegador.`,
    elsewhere: (name: string): string =>
      `Sesión iniciada como ${name}: este servidor no guarda notas; lo que reconoce o aplaza queda en este navegador.`,
    acknowledged: (name: string, at: string): string => `reconocida por ${name} a las ${at}`,
    failed: (why: string): string => `No se ha guardado: ${why}`,
  },
} as const satisfies Record<Language, unknown>;
