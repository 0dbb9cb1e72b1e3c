-- Who may do what. It may be run again at any time.
--
-- lupin_forwarder: its members append to the one site that is named as they are, and see no other.
-- They may forget a tag of it, as its journal does.
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
GRANT UPDATE ON meta, run, hour, tally, event, epoch, forwarder TO lupin_forwarder;
-- A pause that a late write has cut in two is none any more.
GRANT DELETE ON event TO lupin_forwarder;
GRANT INSERT ON note TO lupin_page;
-- What people said is never changed.
REVOKE UPDATE ON note FROM lupin_forwarder, lupin_page;

-- What a forwarder has done for it, as the owner of the tables.
--
-- Parts of scan and look for the month of a moment (s since 1970) and the one behind it, so that it
-- is there before its first row. Long readers keep it from being made; that holds rows up only once
-- they are of that month.
CREATE OR REPLACE FUNCTION make_months(moment BIGINT) RETURNS VOID LANGUAGE plpgsql
SECURITY DEFINER SET lock_timeout = '1s' SET timezone = 'UTC' AS $$
DECLARE
    month TIMESTAMP;
    whole TEXT;
    part TEXT;
BEGIN
    PERFORM pg_advisory_xact_lock(hashtextextended('lupin-twin months', 0));
    FOR month IN SELECT date_trunc('month', to_timestamp(moment)) + n * INTERVAL '1 month'
        FROM generate_series(0, 1) AS n
    LOOP
        CONTINUE WHEN month < '2020-01-01';
        FOREACH whole IN ARRAY ARRAY['scan', 'look'] LOOP
            part := whole || to_char(month, '_YYYY_MM');
            CONTINUE WHEN to_regclass(part) IS NOT NULL;
            BEGIN
                EXECUTE format('CREATE TABLE %I PARTITION OF %I FOR VALUES FROM (%s) TO (%s)',
                    part, whole, extract(epoch FROM month)::BIGINT * 1000000000,
                    extract(epoch FROM month + INTERVAL '1 month')::BIGINT * 1000000000);
            EXCEPTION WHEN lock_not_available THEN
                IF month <= to_timestamp(moment) THEN
                    RAISE;
                END IF;
            END;
        END LOOP;
    END LOOP;
END
$$;

-- All of a tag, or its places alone, up to a number: of the site that is named as who asks.
CREATE OR REPLACE FUNCTION forget_tag(gone TEXT, upto BIGINT, only_places BOOLEAN) RETURNS VOID
LANGUAGE plpgsql SECURITY DEFINER AS $$
DECLARE
    own TEXT := session_user::text;
    theirs BIGINT[];
BEGIN
    DELETE FROM place WHERE site = own AND tag = gone AND seq <= upto;
    IF only_places THEN
        RETURN;
    END IF;
    theirs := ARRAY(SELECT series FROM series WHERE site = own AND tag = gone AND series <= upto);
    DELETE FROM hour WHERE site = own AND series = ANY (theirs);
    DELETE FROM scan WHERE site = own AND series = ANY (theirs);
    DELETE FROM look WHERE site = own AND tag = gone AND seq <= upto;
    DELETE FROM event WHERE site = own AND tag = gone AND seq <= upto;
    DELETE FROM series WHERE site = own AND series = ANY (theirs);
END
$$;

REVOKE EXECUTE ON FUNCTION make_months, forget_tag FROM PUBLIC;
GRANT EXECUTE ON FUNCTION make_months, forget_tag TO lupin_forwarder;
-- A table of the caller's own must not be taken for one of these.
DO $$
DECLARE
    name TEXT;
BEGIN
    FOREACH name IN ARRAY ARRAY['make_months', 'forget_tag'] LOOP
        EXECUTE format('ALTER FUNCTION %s SET search_path = %I, pg_temp', name, current_schema());
    END LOOP;
END
$$;
