-- SPDX-License-Identifier: Apache-2.0
-- The slice of a focal stack in which each micro image is sharpest, and the picture made of those slices.
--
-- While the pixels wait (sharpest_pixels), micro images are summed (lens_sums). When the last line of a row of micro
-- images has arrived, a scan over the row's sums computes the sharpness (lens_sharpness) of the row RADIUS + 1 rows
-- further back and finds its indices; then the first line of that row leaves. Of equally sharp slices the first counts.
-- With VOTE_RADIUS, micro images without texture take their neighbours' slice (index_vote), which delays everything by
-- as many rows. With BUILD.between the depth between slices is computed too (depth_fraction), during the votes. With
-- several pixels a clock, each token lies in at most two micro images, and the scan keeps up with them.
--
-- Latency: sharpness_delay lines and index_latency + 4 clocks. Throughput: one token of all slices each clock. Lines
-- need at least 8 + RADIUS tokens (with votes index_latency), frames a multiple of M lines; empty tokens and flush
-- lines make up for what is missing.
-- Equation: index = argmax over the slices of the sharpness (lens_sharpness); texture as in index_vote.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.delay_pkg.all;
use work.math_pkg.all;
use work.index_pkg.all;
use work.sharpness_pkg.all;
use work.token_pkg.all;

entity sharpness_index is
  generic (
    BUILD : index_build_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Lines of the picture; lines below it do not count. Used with BUILD.cropped only.
    rows : in    std_logic_vector(15 downto 0);
    -- A token and the slices of its pixels: those of the first pixel in the low bits, the first slice lowest; a
    -- slice's picture with a smaller box above the slice.
    token      : in    token_t;
    token_data : in    std_logic_vector(token_bits(BUILD) - 1 downto 0);
    -- Which pixels a line's last token has; constant while a frame is under way.
    line_end : in    std_logic_vector(BUILD.pixels - 1 downto 0);
    -- Pixels of the picture.
    result : out   result_t;
    -- The data of the pixels, packed as in depth_index.
    out_data : out   std_logic_vector(out_bits(BUILD) - 1 downto 0)
  );
end entity sharpness_index;

architecture rtl of sharpness_index is

  constant P           : positive := BUILD.pixels;
  constant SLICES      : positive := BUILD.slices;
  constant RADIUS      : natural  := BUILD.radius;
  constant VOTE_RADIUS : natural  := BUILD.vote_radius;
  constant BETWEEN     : boolean  := BUILD.between;
  constant PLACE_BITS  : positive := bits_for(BUILD.lenses - 1);
  constant SUM_BITS    : positive := BUILD.sum_bits;
  constant ALL_BITS    : positive := BUILD.sharpness_bits;
  constant INDEX_BITS  : positive := bits_for(SLICES - 1);
  constant JUDGED      : positive := index_latency(SLICES, RADIUS, 0, false, P) + choose(BETWEEN, 1, 0);

  -- Clocks from the scan's address to the micro image in the middle of the window, and to its index.
  constant INNER_DELAY : positive := 5 + RADIUS;
  -- A scan begins so many clocks behind a row's last pixel: as soon as its sums can be read.
  constant SUMMED        : positive := lens_sum_latency(P) - 3;
  constant JUDGING_DELAY : positive := JUDGED - SUMMED - 1;
  -- The oldest row of which it matters whether it begins a frame.
  constant OLDEST : positive := larger(2 * RADIUS + 1, RADIUS + 1 + 2 * VOTE_RADIUS);

  subtype lens_t is unsigned(PLACE_BITS - 1 downto 0);

  subtype index_t is unsigned(INDEX_BITS - 1 downto 0);

  subtype sharpness_t is unsigned(ALL_BITS - 1 downto 0);

  type sharpness_list_t is array (natural range 0 to SLICES - 1) of sharpness_t;

  type lenses_t is array (natural range 0 to JUDGING_DELAY) of lens_t;

  -- A token, its place, which pixels lie in the next micro image, and its slices.
  signal placed : token_t;
  signal place  : lens_place_t;
  signal ahead  : std_logic_vector(P - 1 downto 0);
  signal data   : std_logic_vector(token_bits(BUILD) - 1 downto 0);

  -- The scan begins with the last pixel of a row of micro images and goes over the row's sums, one micro image each
  -- clock. It is as long as the row has micro images. The next row is complete M lines later, so scans never overlap,
  -- while pixels go on.
  signal complete_lens  : lens_t    := (others => '0');
  signal complete_live  : std_logic := '0';
  signal complete_start : std_logic := '0';
  -- A row is complete; delayed until its sums can be read.
  signal complete_at : std_logic_vector(0 to SUMMED) := (others => '0');
  -- The scan. Sums, Laplacians and windows follow its address, each a fixed number of clocks later.
  signal scan_on     : std_logic                            := '0';
  signal scan_lens   : lens_t                               := (others => '0');
  signal lens_at     : lenses_t                             := (others => (others => '0'));
  signal scanned_at  : std_logic_vector(0 to JUDGING_DELAY) := (others => '0');
  signal begins_at   : std_logic_vector(0 to 2)             := (others => '0');
  signal inner_1     : std_logic                            := '0';
  signal inner_2     : std_logic                            := '0';
  signal inner_lens  : lens_t;
  signal judged_lens : lens_t;
  -- An index that is final; final_textured: the micro image has texture, if that was judged.
  signal final_write    : std_logic;
  signal final_lens     : lens_t;
  signal final_index    : index_t;
  signal final_textured : std_logic;
  -- Index, texture and depth for the pixels that wait.
  signal index_write    : std_logic;
  signal index_lens     : lens_t;
  signal index          : index_t;
  signal index_textured : std_logic;
  signal index_depth    : depth_t;

  -- Rows of micro images, the newest first: whether they belong to a frame, and whether they begin one.
  signal live         : std_logic_vector(0 to RADIUS + 1) := (others => '0');
  signal starts       : std_logic_vector(0 to OLDEST)     := (others => '0');
  signal joined_above : std_logic;
  signal joined_below : std_logic;
  signal same         : std_logic_vector(2 * RADIUS downto 0);

  -- The sharpness of each slice; the same side by side; the sharpest slice, and the sharpness of it and its neighbours.
  signal sharpness : sharpness_list_t;
  signal energies  : std_logic_vector(SLICES * ALL_BITS - 1 downto 0);
  signal best      : index_t;
  signal most      : sharpness_t;
  signal least     : sharpness_t;
  signal prior     : sharpness_t;
  signal behind    : sharpness_t;

begin

  place_token : entity work.lens_place
    generic map (
      BUILD => BUILD
    )
    port map (
      clk        => clk,
      reset      => reset,
      rows       => rows,
      token      => token,
      token_data => token_data,
      line_end   => line_end,
      placed     => placed,
      place      => place,
      data       => data,
      ahead      => ahead
    );

  --------------------------------------------------------------------------------------------------
  -- A scan over each complete row of micro images.

  complete_at(0) <= place.active and placed.line_last and place.row_last;

  scan : process (clk) is
  begin

    if rising_edge(clk) then
      complete_at(1 to SUMMED) <= complete_at(0 to SUMMED - 1);
      -- Stored until the scan begins, because the next row may have changed the place by then.
      if complete_at(0) = '1' then
        complete_lens  <= place.last_lens(PLACE_BITS - 1 downto 0);
        complete_live  <= place.row_live;
        complete_start <= place.row_starts;
      end if;

      if complete_at(SUMMED) = '1' then
        scan_on   <= '1';
        scan_lens <= (others => '0');
        live      <= complete_live & live(0 to RADIUS);
        starts    <= complete_start & starts(0 to OLDEST - 1);
      elsif scan_on = '1' then
        if scan_lens = complete_lens then
          scan_on <= '0';
        else
          scan_lens <= scan_lens + 1;
        end if;
      end if;

      -- Two clocks later, when the window's sums are ready.
      inner_1 <= scanned_at(INNER_DELAY);
      inner_2 <= inner_1;
      if reset = '1' then
        complete_at(1 to SUMMED) <= (others => '0');

        scan_on <= '0';
        live    <= (others => '0');
      end if;
    end if;

  end process scan;

  lens_at(0)    <= scan_lens;
  scanned_at(0) <= scan_on;
  begins_at(0)  <= '1' when scan_on = '1' and scan_lens = 0 else
                   '0';

  -- The scan's place, delayed for all uses a fixed number of clocks later.
  follow_scan : process (clk) is
  begin

    if rising_edge(clk) then
      lens_at(1 to JUDGING_DELAY)    <= lens_at(0 to JUDGING_DELAY - 1);
      scanned_at(1 to JUDGING_DELAY) <= scanned_at(0 to JUDGING_DELAY - 1);
      begins_at(1 to 2)              <= begins_at(0 to 1);
      if reset = '1' then
        scanned_at(1 to JUDGING_DELAY) <= (others => '0');
      end if;
    end if;

  end process follow_scan;

  inner_lens  <= lens_at(INNER_DELAY);
  judged_lens <= lens_at(JUDGING_DELAY);

  -- Laplacians are those of row 1; the window's middle is row RADIUS + 1.
  joined_above <= not starts(1);
  joined_below <= live(0) and not starts(0);

  -- A window may reach across the border between two frames: rows of the other frame count as beyond the edge.
  find_same : process (starts) is
  begin

    same <= (others => '1');

    for i in 0 to 2 * RADIUS loop

      for j in 1 to 2 * RADIUS loop

        if starts(j) = '1' and ((i + 1 <= j and j <= RADIUS) or (RADIUS + 1 <= j and j <= i)) then
          same(i) <= '0';
        end if;

      end loop;

    end loop;

  end process find_same;

  slice : for s in 0 to SLICES - 1 generate

    signal sum : std_logic_vector(SUM_BITS - 1 downto 0);

  begin

    sums : entity work.lens_sums
      generic map (
        BUILD => BUILD,
        SLICE => s
      )
      port map (
        clk       => clk,
        place     => place,
        ahead     => ahead,
        data      => data,
        read_lens => scan_lens,
        sum       => sum
      );

    judge : entity work.lens_sharpness
      generic map (
        BUILD => BUILD
      )
      port map (
        clk          => clk,
        lens         => scan_lens,
        begins       => begins_at(2),
        scans        => scanned_at(2),
        sum          => sum,
        live         => live(1),
        joined_above => joined_above,
        joined_below => joined_below,
        same         => same,
        inner_lens   => inner_lens,
        inner        => inner_2,
        sharpness    => sharpness(s)
      );

    energies((s + 1) * ALL_BITS - 1 downto s * ALL_BITS) <= std_logic_vector(sharpness(s));

  end generate slice;

  sharpest : entity work.sharpest_slice
    generic map (
      BUILD => BUILD
    )
    port map (
      clk       => clk,
      sharpness => energies,
      index     => best,
      most      => most,
      least     => least,
      prior     => prior,
      behind    => behind
    );

  --------------------------------------------------------------------------------------------------
  -- Votes of neighbours.

  no_votes : if VOTE_RADIUS = 0 and BUILD.boxes = 1 generate
    final_write    <= scanned_at(JUDGING_DELAY);
    final_lens     <= judged_lens;
    final_index    <= best;
    final_textured <= '1';
  end generate no_votes;

  texture_alone : if VOTE_RADIUS = 0 and BUILD.boxes > 1 generate

    -- A clock for the comparison with the confidence, as votes have one.
    find_texture : process (clk) is
    begin

      if rising_edge(clk) then
        final_write    <= scanned_at(JUDGING_DELAY);
        final_lens     <= judged_lens;
        final_index    <= best;
        final_textured <= has_texture(most, least, BUILD.confidence);
        if reset = '1' then
          final_write <= '0';
        end if;
      end if;

    end process find_texture;

  end generate texture_alone;

  votes : if VOTE_RADIUS > 0 generate

    -- The row in the middle of the window of votes.
    constant MIDDLE : positive := RADIUS + 1 + VOTE_RADIUS;

    signal same_votes : std_logic_vector(2 * VOTE_RADIUS downto 0);

  begin

    find_same_votes : process (starts) is
    begin

      same_votes <= (others => '1');

      for i in 0 to 2 * VOTE_RADIUS loop

        for j in RADIUS + 1 to RADIUS + 2 * VOTE_RADIUS loop

          if starts(j) = '1' and ((RADIUS + 1 + i <= j and j < MIDDLE) or (MIDDLE <= j and j <= RADIUS + i)) then
            same_votes(i) <= '0';
          end if;

        end loop;

      end loop;

    end process find_same_votes;

    vote : entity work.index_vote
      generic map (
        BUILD => BUILD
      )
      port map (
        clk         => clk,
        reset       => reset,
        active      => scanned_at(JUDGING_DELAY),
        lens        => judged_lens,
        index       => best,
        most        => most,
        least       => least,
        live        => live(RADIUS + 1),
        same        => same_votes,
        starts      => starts(MIDDLE),
        voted_write => final_write,
        voted_lens  => final_lens,
        voted_index => final_index,
        voted_kept  => final_textured
      );

  end generate votes;

  --------------------------------------------------------------------------------------------------
  -- Depth between slices.

  slices_alone : if not BETWEEN generate
    index_write    <= final_write;
    index_lens     <= final_lens;
    index          <= final_index;
    index_textured <= final_textured;
    index_depth    <= NO_DEPTH;
  end generate slices_alone;

  between_slices : if BETWEEN generate

    constant FINAL_BITS : positive := PLACE_BITS + INDEX_BITS + 2;
    constant VOTE_WAIT  : natural  := larger(FRACTION_LATENCY - vote_latency(SLICES, VOTE_RADIUS, BUILD.boxes), 0);

    signal own_depth : depth_t;
    signal voted     : std_logic_vector(FINAL_BITS - 1 downto 0);
    signal waiting   : std_logic_vector(delay_bits(FINAL_BITS, VOTE_WAIT) - 1 downto 0) := (others => '0');
    signal waited    : std_logic_vector(FINAL_BITS - 1 downto 0);

  begin

    fraction : entity work.depth_fraction
      generic map (
        BUILD => BUILD
      )
      port map (
        clk    => clk,
        reset  => reset,
        active => scanned_at(JUDGING_DELAY),
        lens   => judged_lens,
        index  => best,
        most   => most,
        prior  => prior,
        behind => behind,
        depth  => own_depth
      );

    voted <= std_logic_vector(final_lens) & std_logic_vector(final_index) & final_textured & final_write;

    -- The votes may be done before the division.
    wait_for_fraction : process (clk) is
    begin

      if rising_edge(clk) then
        waiting <= moved_on(waiting, voted, reset => reset);
      end if;

    end process wait_for_fraction;

    waited <= delayed(waiting, voted, VOTE_WAIT);

    index_write    <= waited(0);
    index_textured <= waited(1);
    index          <= unsigned(waited(INDEX_BITS + 1 downto 2));
    index_lens     <= unsigned(waited(FINAL_BITS - 1 downto INDEX_BITS + 2));
    -- A slice from the neighbours' votes has no depth between slices.
    index_depth <= own_depth when waited(1) = '1' or VOTE_RADIUS = 0 else
                   NO_DEPTH;

  end generate between_slices;

  pixels : entity work.sharpest_pixels
    generic map (
      BUILD => BUILD
    )
    port map (
      clk            => clk,
      reset          => reset,
      token          => placed,
      place          => place,
      ahead          => ahead,
      data           => data,
      line_end       => line_end,
      index_write    => index_write,
      index_lens     => index_lens,
      index          => index,
      index_textured => index_textured,
      index_depth    => index_depth,
      result         => result,
      out_data       => out_data
    );

end architecture rtl;
