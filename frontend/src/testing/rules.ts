import { leaveAsFound } from './asFound';

leaveAsFound();
