/** What loads right after the first view, in one piece. */
export { default as Alarms } from './Alarms';
export { default as Causes } from './Causes';
export { default as Report } from './Report';
