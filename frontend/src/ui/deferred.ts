/**
 * What the first view does not need, as one chunk loaded right after it: cards, lists and tools that
 * open on request. Only `loadDeferred.tsx` loads it.
 */
import '../styles/card.css';
import '../styles/hover.css';
import '../styles/timebar.css';
import '../styles/alarms.css';
import '../styles/alarm-rows.css';
import '../styles/row-menu.css';
import '../styles/attention.css';
import '../styles/comments.css';
import '../styles/difference.css';
import '../styles/paper.css';
// Last, as it overrides the others.
import '../styles/print.css';

export { startBadge, startNotify, startSound } from '../alarms/notify';
export { saveTable } from '../export/actions';
export { startNotes } from '../notes/NoteMarks';
export { startDifference } from '../store/difference';
export { startOpening, startRemembered } from '../store/remembered';
export { TimeBar } from '../timebar/TimeBar';
export { AlarmPanel } from './alarms/AlarmPanel';
export { Meanwhile } from './alarms/AlarmNotes';
export { startPeople } from './alarms/people';
export { AttentionList, KioskNote, startKioskClose } from './AttentionList';
export { CompareControl, DifferenceLegend } from './CompareControl';
export { HelpDialog, openHelp, onKey } from './HelpDialog';
export { InLayers, InLegend, OnMap } from './extras';
export { startShell } from './install';
export { Menu } from './Menu';
export { PaperLine } from './PaperLine';
export { TableChoices } from './TableChoices';
export { TagCard } from './TagCard';
