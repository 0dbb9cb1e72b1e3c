/** What the page has of the robot; loaded together when the first frame of one has come. */
import '../styles/robot.css';

export { RobotChoice } from './RobotChoice';
export { RobotFact } from './RobotFact';
export { RobotLayer } from './RobotLayer';
