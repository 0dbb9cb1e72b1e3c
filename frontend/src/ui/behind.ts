/**
 * What the first view can do without, in one piece that comes right behind it: cards, lists and
 * tools that somebody has to ask for first. Only `later.ts` loads it.
 */
import '../styles/card.css';
import '../styles/hover.css';
import '../styles/timebar.css';
import '../styles/alarms.css';
import '../styles/alarm-rows.css';
import '../styles/row-menu.css';
import '../styles/attention.css';
import '../styles/comments.css';
import '../styles/bound.css';
import '../styles/paper.css';
// Last, as it takes back what the others say.
import '../styles/print.css';

export { startBadge } from '../alarms/notify';
export { startNotify } from '../alarms/notify';
export { startSound } from '../alarms/notify';
export { saveTable } from '../export/actions';
export { startGestures } from '../map/gestures';
export { startComments } from '../notes/CommentMarks';
export { startDifference } from '../store/difference';
export { startOpening } from '../store/remembered';
export { startRemembered } from '../store/remembered';
export { TimeBar } from '../timebar/TimeBar';
export { AlarmPanel } from './alarms/AlarmPanel';
export { Meanwhile } from './alarms/AlarmNotes';
export { startPeople } from './alarms/people';
export { AttentionList } from './AttentionList';
export { CompareControl } from './CompareControl';
export { DifferenceLegend } from './CompareControl';
export { HelpDialog, openHelp } from './HelpDialog';
export { InLayers, InLegend, OnMap } from './extras';
export { startShell } from './install';
export { KioskNote, startLeaving } from './AttentionList';
export { Menu } from './Menu';
export { onKey } from './HelpDialog';
export { PaperLine } from './PaperLine';
export { RangeControl } from './RangeControl';
export { TableChoices } from './TableChoices';
export { TagCard } from './TagCard';
