/** What the rest of the page has of the estimate; loaded together when the first of them is needed. */
import '../styles/estimate.css';

export { AdviceMarks } from './AdviceMarks';
export { CardEstimate } from './CardEstimate';
export { ErrorScale } from './ErrorScale';
export { EstimateFacts } from './EstimateFacts';
export { EstimateReadout } from './EstimateReadout';
