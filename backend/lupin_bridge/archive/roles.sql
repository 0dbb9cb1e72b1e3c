-- Who may do what. It may be run again at any time.
--
-- lupin_forwarder: its members append to the one site that is named as they are, and see no other.
-- lupin_page: its members read every site, and write notes.
DO $$
BEGIN
    IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = 'lupin_forwarder') THEN
        CREATE ROLE lupin_forwarder NOLOGIN;
    END IF;
    IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = 'lupin_page') THEN
        CREATE ROLE lupin_page NOLOGIN;
    END IF;
END
$$;

GRANT SELECT ON archive TO lupin_forwarder, lupin_page;

DO $$
DECLARE
    name TEXT;
BEGIN
    FOREACH name IN ARRAY ARRAY['meta', 'site', 'run', 'series', 'scan', 'look', 'place', 'hour',
        'tally', 'event', 'note', 'epoch', 'forwarder']
    LOOP
        EXECUTE format('ALTER TABLE %I ENABLE ROW LEVEL SECURITY', name);
        EXECUTE format('DROP POLICY IF EXISTS own_site ON %I', name);
        EXECUTE format('CREATE POLICY own_site ON %I TO lupin_forwarder'
            ' USING (site = current_user::text) WITH CHECK (site = current_user::text)', name);
        EXECUTE format('DROP POLICY IF EXISTS every_site ON %I', name);
        EXECUTE format('CREATE POLICY every_site ON %I TO lupin_page'
            ' USING (true) WITH CHECK (true)', name);
        EXECUTE format('GRANT SELECT, INSERT ON %I TO lupin_forwarder', name);
        EXECUTE format('GRANT SELECT ON %I TO lupin_page', name);
    END LOOP;
END
$$;

-- What a journal says anew: counts of an hour that goes on, a run that has ended, who forwards.
GRANT UPDATE ON meta, run, hour, tally, event, note, epoch, forwarder TO lupin_forwarder;
-- A pause that a late write has cut in two is none any more.
GRANT DELETE ON event TO lupin_forwarder;
GRANT INSERT, UPDATE ON note TO lupin_page;
