/** Of the field that filters the table, for what moves the focus there. */
export const FILTER_ID = 'tag-filter';
