/** Texts about people, bundled with their components; few, so all languages are in one file. */
import type { Language } from './languages';

export const PEOPLE = {
  en: {
    shared: (name: string): string =>
      `Signed in as ${name}: everybody sees what you acknowledge or shelve.`,
    reads: (name: string): string =>
      `Signed in as ${name} (viewer): you see alarms, but cannot acknowledge or shelve them.`,
    elsewhere: (name: string): string =>
      `Signed in as ${name}: this server stores no notes, so you cannot acknowledge or shelve alarms here.`,
    acknowledged: (name: string, at: string): string => `acknowledged by ${name}, ${at}`,
    failed: (why: string): string => `Not saved: ${why}`,
  },
  de: {
    shared: (name: string): string =>
      `Angemeldet als ${name}: Was Sie quittieren oder zurückstellen, sehen alle.`,
    reads: (name: string): string =>
      `Angemeldet als ${name}, nur lesend: Sie sehen Alarme, können sie aber nicht quittieren oder zurückstellen.`,
    elsewhere: (name: string): string =>
      `Angemeldet als ${name}: Dieser Server speichert keine Notizen. Alarme können Sie hier nicht quittieren oder zurückstellen.`,
    acknowledged: (name: string, at: string): string => `quittiert von ${name}, ${at}`,
    failed: (why: string): string => `Nicht gespeichert: ${why}`,
  },
  nl: {
    shared: (name: string): string =>
      `Aangemeld als ${name}: wat u bevestigt of uitstelt, ziet iedereen.`,
    reads: (name: string): string =>
      `Aangemeld als ${name} (alleen lezen): u ziet alarmen, maar kunt ze niet bevestigen of uitstellen.`,
    elsewhere: (name: string): string =>
      `Aangemeld als ${name}: deze server slaat geen notities op; u kunt hier geen alarmen bevestigen of uitstellen.`,
    acknowledged: (name: string, at: string): string => `bevestigd door ${name}, ${at}`,
    failed: (why: string): string => `Niet opgeslagen: ${why}`,
  },
  es: {
    shared: (name: string): string =>
      `Sesión iniciada como ${name}: todos ven lo que usted reconoce o aplaza.`,
    reads: (name: string): string =>
      `Sesión iniciada como ${name}, solo lectura: ve las alarmas, pero no puede reconocerlas ni aplazarlas.`,
    elsewhere: (name: string): string =>
      `Sesión iniciada como ${name}: este servidor no guarda notas; aquí no puede reconocer ni aplazar alarmas.`,
    acknowledged: (name: string, at: string): string => `reconocida por ${name}, ${at}`,
    failed: (why: string): string => `No se ha guardado: ${why}`,
  },
} as const satisfies Record<Language, unknown>;
