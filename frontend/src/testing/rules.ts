import { afterAll } from 'vitest';

import { asFound } from './asFound';

afterAll(asFound());
