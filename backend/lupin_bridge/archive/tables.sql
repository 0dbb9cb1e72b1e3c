-- What the archive has beside the log's own tables.
CREATE TABLE archive (version INTEGER NOT NULL);
-- A journal that was forwarded. Its numbers are moved by so much here: of seq and series by
-- seq_offset, of run by run_offset. forwarded_seq is the last of its numbers that is here.
CREATE TABLE epoch (
    site TEXT NOT NULL, epoch INTEGER NOT NULL, journal_id TEXT NOT NULL,
    begun_at TIMESTAMPTZ NOT NULL DEFAULT now(), seq_offset BIGINT NOT NULL,
    run_offset BIGINT NOT NULL, forwarded_seq BIGINT NOT NULL, PRIMARY KEY (site, epoch)
);
-- Who forwards a site, and when that was heard last, by this server's clock.
CREATE TABLE forwarder (
    site TEXT NOT NULL PRIMARY KEY, machine TEXT NOT NULL, process INTEGER NOT NULL,
    since TIMESTAMPTZ NOT NULL, heard_at TIMESTAMPTZ NOT NULL
);
-- Parts for what is before 2020, such as a simulated clock's; `make_months` makes the others. There is
-- no default part: with one, PostgreSQL looks into every part for the newest row of a series.
CREATE TABLE scan_before PARTITION OF scan FOR VALUES FROM (MINVALUE) TO (1577836800000000000);
CREATE TABLE look_before PARTITION OF look FOR VALUES FROM (MINVALUE) TO (1577836800000000000);
