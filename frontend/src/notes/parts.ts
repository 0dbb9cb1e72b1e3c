/** What shows comments, in one piece that comes when the first of it is shown. */
import '../styles/comments.css';

export { CommentMarks } from './CommentMarks';
export { Comments } from './Comments';
export { SiteComment } from './SiteComment';
