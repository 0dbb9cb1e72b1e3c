/** Texts about people's notes, bundled with their components; few, so all languages are in one file. */
import type { Language } from './languages';

export const NOTES = {
  en: {
    shared: (name: string): string =>
      `Signed in as ${name}: everybody sees what you acknowledge or shelve.`,
    reads: (name: string): string =>
      `Signed in as ${name} (viewer): you see alarms, but cannot acknowledge or shelve them.`,
    elsewhere: (name: string): string =>
      `Signed in as ${name}: this server stores no notes, so you cannot acknowledge or shelve alarms here.`,
    failed: (why: string): string => `Not saved: ${why}`,
    title: 'Comments',
    comment: 'Comment',
    site: 'greenhouse',
    alarm: (tag: string): string => (tag ? `alarm at ${tag}` : 'alarm'),
    unshelved: 'no longer shelved',
    now: 'Comment (now)',
    then: (at: string): string => `Comment (${at})`,
    send: 'Save',
    withdraw: 'Withdraw',
  },
  de: {
    shared: (name: string): string =>
      `Angemeldet als ${name}: Alle sehen, was hier quittiert oder zurückgestellt wird.`,
    reads: (name: string): string =>
      `Angemeldet als ${name}, nur lesend: Alarme lassen sich ansehen, aber nicht quittieren oder zurückstellen.`,
    elsewhere: (name: string): string =>
      `Angemeldet als ${name}: Dieser Server speichert keine Notizen; Alarme lassen sich hier nicht quittieren oder zurückstellen.`,
    failed: (why: string): string => `Nicht gespeichert: ${why}`,
    title: 'Kommentare',
    comment: 'Kommentieren',
    site: 'Gewächshaus',
    alarm: (tag: string): string => (tag ? `Alarm an ${tag}` : 'Alarm'),
    unshelved: 'wieder aktiviert',
    now: 'Kommentar (jetzt)',
    then: (at: string): string => `Kommentar (${at})`,
    send: 'Speichern',
    withdraw: 'Zurücknehmen',
  },
  nl: {
    shared: (name: string): string =>
      `Aangemeld als ${name}: wat u bevestigt of uitstelt, ziet iedereen.`,
    reads: (name: string): string =>
      `Aangemeld als ${name} (alleen lezen): u ziet alarmen, maar kunt ze niet bevestigen of uitstellen.`,
    elsewhere: (name: string): string =>
      `Aangemeld als ${name}: deze server slaat geen notities op; u kunt hier geen alarmen bevestigen of uitstellen.`,
    failed: (why: string): string => `Niet opgeslagen: ${why}`,
    title: 'Opmerkingen',
    comment: 'Opmerking',
    site: 'kas',
    alarm: (tag: string): string => (tag ? `alarm bij ${tag}` : 'alarm'),
    unshelved: 'niet meer uitgesteld',
    now: 'Opmerking (nu)',
    then: (at: string): string => `Opmerking (${at})`,
    send: 'Opslaan',
    withdraw: 'Intrekken',
  },
  es: {
    shared: (name: string): string =>
      `Sesión iniciada como ${name}: todos ven lo que usted reconoce o aplaza.`,
    reads: (name: string): string =>
      `Sesión iniciada como ${name}, solo lectura: ve las alarmas, pero no puede reconocerlas ni aplazarlas.`,
    elsewhere: (name: string): string =>
      `Sesión iniciada como ${name}: este servidor no guarda notas; aquí no puede reconocer ni aplazar alarmas.`,
    failed: (why: string): string => `No se ha guardado: ${why}`,
    title: 'Comentarios',
    comment: 'Comentar',
    site: 'invernadero',
    alarm: (tag: string): string => (tag ? `alarma en ${tag}` : 'alarma'),
    unshelved: 'reactivada',
    now: 'Comentario (ahora)',
    then: (at: string): string => `Comentario (${at})`,
    send: 'Guardar',
    withdraw: 'Retirar',
  },
} as const satisfies Record<Language, unknown>;
