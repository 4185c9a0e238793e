-- SPDX-License-Identifier: Apache-2.0
-- Keeps the last pixels of a line, several a token, and gives for each of P neighbouring outputs the pixel that it
-- adds minus the pixel that it subtracts.
--
--   pixels -> rotation -> banks, read twice -> difference -> bank_exchange -> rotation -> differences
--
-- The pixels of a token go to different banks, and so do the pixels that the outputs of a token add (sum_lanes_pkg).
-- The pixels to subtract are those that outputs B before have added, B the box: each bank of a pixel to add has its
-- bank of the pixel to subtract. Pixels outside the line count as zero.
--
-- Latency: 5 clocks from the inputs to the differences, 6 with several slices. Throughput: one token each clock.
-- Equation: difference j = x(e(o + j)) - x(e(o + j - B)), o the first output of the token.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.moving_sum_pkg.all;
use work.sum_lanes_pkg.all;

entity pixel_banks is
  generic (
    -- Sizes of lane_stage.
    BUILD : lanes_build_t
  );
  port (
    clk : in    std_logic;
    -- From lane_control: where the token's pixels go, and the outputs that leave; the token's pixels, pixel 0 in
    -- the low bits.
    write_1  : in    lanes_write_t;
    pixels_1 : in    std_logic_vector(BUILD.pixels * BUILD.channels * BUILD.pixel_bits - 1 downto 0);
    read_1   : in    lanes_read_t;
    -- The differences: signed, a bit wider than a channel.
    differences : out   std_logic_vector(BUILD.pixels * BUILD.channels * (BUILD.pixel_bits + 1) - 1 downto 0)
  );
end entity pixel_banks;

architecture rtl of pixel_banks is

  constant GEOMETRY : geometry_t := BUILD.geometry;

  constant M      : positive := BUILD.geometry.micro_image_size;
  constant P      : positive := BUILD.pixels;
  constant SLICES : positive := GEOMETRY.slices;
  constant BANKS  : positive := bank_count(M, P);
  constant STEP   : positive := bank_step(M, P);
  constant PLACES : positive := token_places(M, P);
  -- The range of rows, counted from the output's own row, in which its pixels can lie; includes leaving pixels and
  -- the next row.
  constant LOWEST  : integer  := -larger(1 - BUILD.rows.lowest, 1);
  constant HIGHEST : integer  := larger(BUILD.rows.highest + 1, 1);
  constant WIDTH   : positive := BUILD.channels * BUILD.pixel_bits;
  -- Width of a difference of one channel, and of all channels.
  constant DIFFERENCE_BITS  : positive := BUILD.pixel_bits + 1;
  constant DIFFERENCE_WIDTH : positive := BUILD.channels * DIFFERENCE_BITS;

  subtype place_t is natural range 0 to larger(PLACES - 1, 1);

  subtype bank_t is natural range 0 to larger(BANKS - 1, 1);

  subtype row_t is unsigned(BUILD.row_bits - 1 downto 0);

  subtype pixel_t is std_logic_vector(WIDTH - 1 downto 0);

  subtype difference_t is std_logic_vector(DIFFERENCE_WIDTH - 1 downto 0);

  -- A row counted from that of the output.
  subtype distance_t is integer range LOWEST to HIGHEST;

  type distances_t is array (natural range 0 to BANKS - 1) of distance_t;

  type rows_t is array (natural range 0 to BANKS - 1) of row_t;

  type pixels_t is array (natural range 0 to BANKS - 1) of pixel_t;

  -- Index of the pixels that enter, and of those that leave.
  constant ENTER : natural := 0;
  constant LEAVE : natural := 1;

  type both_rows_t is array (ENTER to LEAVE) of rows_t;

  type both_pixels_t is array (ENTER to LEAVE) of pixels_t;

  -- What is read of a bank: the place that reads it, the row, and the pixel to subtract.
  type read_t is record
    place : bank_t;
    row   : distance_t;
    left  : left_t;
  end record read_t;

  type reads_t is array (natural range 0 to BANKS - 1) of read_t;

  type reads_of_slices_t is array (natural range 0 to SLICES - 1) of reads_t;

  -- Clocks from a place to the differences of its banks.
  constant CHANGED : positive := 5 + choose(SLICES > 1, 1, 0);

  -- The place of the outputs, delayed until their differences come; their slice, delayed for the exchange.
  type turns_t is array (1 to CHANGED) of place_t;

  type slices_t is array (1 to 4) of unsigned(bits_for(SLICES - 1) - 1 downto 0);

  subtype flags_t is std_logic_vector(BANKS - 1 downto 0);

  function all_reads return reads_of_slices_t is

    variable reads : reads_of_slices_t;

  begin

    for s in 0 to SLICES - 1 loop

      for r in 0 to BANKS - 1 loop

        -- This is the inverse of bank_exchange's table: each bank is read for one place only.
        reads(s)(entering_bank(GEOMETRY, P, s, r)) :=
        (
          place => r,
          row   => entering_row(GEOMETRY, P, s, r),
          left  => left_pixel(GEOMETRY, P, s, r)
        );

      end loop;

    end loop;

    return reads;

  end function all_reads;

  constant READ_OF : reads_of_slices_t := all_reads;

  -- Rows of slice 0, from which the rows of pixels to subtract can be counted before a token has come.
  function first_distances return distances_t is

    variable distances : distances_t;

  begin

    for b in distances'range loop

      distances(b) := READ_OF(0)(b).row;

    end loop;

    return distances;

  end function first_distances;

  -- With boxes of M alone the pixel to subtract lies M before the one to add, in all slices alike.
  constant LEFT_SLICES : positive := choose(largest_box(GEOMETRY) = M and not boxes_differ(GEOMETRY), 1, SLICES);

  -- Whether a pixel, counted from the outputs, lies in the line: not before its begin, and not behind the last
  -- pixel that has arrived.
  function in_line (
    distance  : integer;
    rows      : natural;
    ahead     : natural;
    bank      : natural;
    end_place : natural
  ) return std_logic is
  begin

    -- The first condition is the begin: a line begins at bank 0 of its first row. The second is the end: the
    -- pixel lies in an earlier row than the last pixel, or in the same row at an earlier bank.
    if rows + distance >= 0 and (distance < ahead or (distance = ahead and bank < end_place)) then
      return '1';
    end if;

    return '0';

  end function in_line;

  function moved (
    row      : row_t;
    distance : integer
  ) return row_t is
  begin

    -- Row numbers wrap round like the memories' addresses.
    return unsigned(signed(row) + to_signed(distance, BUILD.row_bits));

  end function moved;

  -- Rotates the words of all banks, each of so many bits, down by some tokens' places; words that fall out at the
  -- bottom come in at the top. Each bit of the number is a level of multiplexers that rotate by 1, 2, 4 and so on.
  -- Names of signals end in the number of clocks behind a token.
  function rotated (
    words  : std_logic_vector;
    places : place_t;
    width  : positive
  ) return std_logic_vector is

    constant LEVELS : positive := bits_for(larger(BANKS / STEP - 1, 1));

    variable now  : std_logic_vector(BANKS * width - 1 downto 0);
    variable last : std_logic_vector(BANKS * width - 1 downto 0);
    variable turn : unsigned(LEVELS - 1 downto 0);

  begin

    now  := words;
    turn := to_unsigned(places, LEVELS);

    for l in 0 to LEVELS - 1 loop

      last := now;

      if turn(l) = '1' then

        for i in 0 to BANKS - 1 loop

          now((i + 1) * width - 1 downto i * width) := last(((i + STEP * 2 ** l) mod BANKS + 1) * width - 1 downto
                                                            (i + STEP * 2 ** l) mod BANKS * width);

        end loop;

      end if;

    end loop;

    return now;

  end function rotated;

  -- Outputs of lane_control, cut to the widths needed here.
  signal write_place_1 : place_t;
  signal write_row_1   : row_t;
  signal read_slice_1  : unsigned(bits_for(SLICES - 1) - 1 downto 0);
  signal read_place_1  : place_t;
  signal read_row_1    : row_t;
  signal read_rows_1   : natural range 0 to BUILD.most_rows;
  signal end_place_1   : place_t;
  signal end_row_1     : row_t;
  -- Clock 1: the token's pixels, rotated so that each stands at its bank.
  signal padded_1   : std_logic_vector(BANKS * WIDTH - 1 downto 0);
  signal write_turn : place_t;
  signal rotated_1  : std_logic_vector(BANKS * WIDTH - 1 downto 0);
  -- Clock 2: what is written and where; the rows to read, relative to the output's; and the limits of the line.
  signal in_2       : std_logic_vector(BANKS * WIDTH - 1 downto 0);
  signal writes_2   : flags_t                                    := (others => '0');
  signal wrapped_2  : flags_t                                    := (others => '0');
  signal row_2      : row_t                                      := (others => '0');
  signal next_row_2 : row_t                                      := (others => '0');
  signal distance_2 : distances_t                                := first_distances;
  signal read_row_2 : row_t                                      := (others => '0');
  signal rows_2     : natural range 0 to BUILD.most_rows         := 0;
  signal ahead_2    : natural range 0 to 2 ** BUILD.row_bits - 1 := 0;
  signal end_2      : natural range 0 to BANKS                   := 0;
  -- Clock 3: a bank's rows to read for the entering and the leaving pixel, and whether these pixels lie in the
  -- line. Clock 4: their words.
  signal rows_3        : both_rows_t := (others => (others => (others => '0')));
  signal enters_3      : flags_t     := (others => '0');
  signal leaves_3      : flags_t     := (others => '0');
  signal enters_4      : flags_t     := (others => '0');
  signal leaves_4      : flags_t     := (others => '0');
  signal words_4       : both_pixels_t;
  signal changes_5     : std_logic_vector(BANKS * DIFFERENCE_WIDTH - 1 downto 0);
  signal read_place_at : turns_t     := (others => 0);
  signal read_slice_at : slices_t    := (others => (others => '0'));
  signal exchanged     : std_logic_vector(BANKS * DIFFERENCE_WIDTH - 1 downto 0);
  signal turned        : std_logic_vector(BANKS * DIFFERENCE_WIDTH - 1 downto 0);

begin

  write_place_1 <= write_1.place;
  write_row_1   <= write_1.row(BUILD.row_bits - 1 downto 0);
  read_slice_1  <= read_1.slice(read_slice_1'range);
  read_place_1  <= read_1.place;
  read_row_1    <= read_1.row(BUILD.row_bits - 1 downto 0);
  read_rows_1   <= read_1.rows;
  end_place_1   <= read_1.end_place;
  end_row_1     <= read_1.end_row(BUILD.row_bits - 1 downto 0);

  --------------------------------------------------------------------------------------------------
  -- Write path: a token's pixels go to their banks.

  -- Banks beyond the token's pixels get zeros; their writes are off.
  padded_1(P * WIDTH - 1 downto 0) <= pixels_1;

  no_pixels : if BANKS > P generate
    padded_1(BANKS * WIDTH - 1 downto P * WIDTH) <= (others => '0');
  end generate no_pixels;

  -- Rotating down by the rest moves the pixels up to the token's place.
  write_turn <= 0 when write_place_1 = 0 else
                PLACES - write_place_1;

  rotated_1 <= rotated(padded_1, write_turn, WIDTH);

  find_rows : process (clk) is

    variable distance : distance_t;
    variable read     : read_t;
    variable left     : left_t;

  begin

    if rising_edge(clk) then
      -- Clock 1: the word to write, and where the outputs' pixels are.
      in_2       <= rotated_1;
      row_2      <= write_row_1;
      next_row_2 <= write_row_1 + 1;
      read_row_2 <= read_row_1;
      rows_2     <= read_rows_1;
      -- Rows from the output to the newest pixel. The difference is taken modulo the memory, which holds them all.
      ahead_2 <= to_integer(end_row_1 - read_row_1);
      end_2   <= STEP * end_place_1;

      for b in 0 to BANKS - 1 loop

        -- A token's pixels lie in P banks from its place on; past the last bank they go on in the next row.
        writes_2(b)  <= '0';
        wrapped_2(b) <= '0';
        if STEP * write_place_1 > b then
          wrapped_2(b) <= '1';
          if STEP * write_place_1 + P > b + BANKS then
            writes_2(b) <= write_1.valid;
          end if;
        elsif STEP * write_place_1 + P > b then
          writes_2(b) <= write_1.valid;
        end if;

        -- The outputs belong to the older line, so its slice (read_slice) selects the tables.
        read := READ_OF(0)(b);

        for s in 1 to SLICES - 1 loop

          if read_slice_1 = s then
            read := READ_OF(s)(b);
          end if;

        end loop;

        -- Outputs at places before the token's first place lie in the next row.
        distance_2(b) <= read.row;
        if read.place < STEP * read_place_1 then
          distance_2(b) <= read.row + 1;
        end if;

      end loop;

      -- Clock 2: the rows, and whether they belong to the line.
      for b in 0 to BANKS - 1 loop

        distance         := distance_2(b);
        rows_3(ENTER)(b) <= moved(read_row_2, distance);
        enters_3(b)      <= in_line(distance, rows_2, ahead_2, b, end_2);

        for s in 0 to LEFT_SLICES - 1 loop

          if LEFT_SLICES = 1 or read_slice_at(2) = s then
            left     := READ_OF(s)(b).left;
            distance := distance_2(b) + left.rows;

            rows_3(LEAVE)(left.bank) <= moved(read_row_2, distance);
            leaves_3(b)              <= in_line(distance, rows_2, ahead_2, left.bank, end_2);
          end if;

        end loop;

      end loop;

      enters_4 <= enters_3;
      leaves_4 <= leaves_3;
    end if;

  end process find_rows;

  -- A bank is written by at most one pixel of a token, and read for at most one output.
  every_bank : for b in 0 to BANKS - 1 generate

    signal write_row : row_t;
    signal change_5  : difference_t;

  begin

    -- The part of a token that goes past the last bank lies one row further.
    write_row <= next_row_2 when wrapped_2(b) = '1' else
                 row_2;

    -- Two memories hold the same pixels: one is read for entering pixels, one for leaving pixels.
    each_read : for i in ENTER to LEAVE generate

      pixels : entity work.ram_simple_dual_port
        generic map (
          WIDTH        => WIDTH,
          WORDS        => 2 ** BUILD.row_bits,
          READ_LATENCY => 1
        )
        port map (
          clk           => clk,
          write_enable  => writes_2(b),
          write_address => write_row,
          write_data    => in_2((b + 1) * WIDTH - 1 downto b * WIDTH),
          read_address  => rows_3(i)(b),
          read_data     => words_4(i)(b)
        );

    end generate each_read;

    subtract : process (clk) is

      variable left       : pixel_t;
      variable entering   : unsigned(BUILD.pixel_bits - 1 downto 0);
      variable leaving    : unsigned(BUILD.pixel_bits - 1 downto 0);
      variable difference : unsigned(DIFFERENCE_BITS - 1 downto 0);

    begin

      if rising_edge(clk) then
        left := words_4(LEAVE)(READ_OF(0)(b).left.bank);

        for s in 1 to LEFT_SLICES - 1 loop

          if read_slice_at(4) = s then
            left := words_4(LEAVE)(READ_OF(s)(b).left.bank);
          end if;

        end loop;

        -- A pixel outside the line counts as zero, whatever the memory still holds there.
        for c in 0 to BUILD.channels - 1 loop

          entering := (others => '0');
          leaving  := (others => '0');
          if enters_4(b) = '1' then
            entering := unsigned(words_4(ENTER)(b)((c + 1) * BUILD.pixel_bits - 1 downto c * BUILD.pixel_bits));
          end if;
          if leaves_4(b) = '1' then
            leaving := unsigned(left((c + 1) * BUILD.pixel_bits - 1 downto c * BUILD.pixel_bits));
          end if;
          -- Differences are in two's complement, so the prefix sums need no signs.
          difference := resize(entering, DIFFERENCE_BITS) - resize(leaving, DIFFERENCE_BITS);

          change_5((c + 1) * DIFFERENCE_BITS - 1 downto c * DIFFERENCE_BITS) <= std_logic_vector(difference);

        end loop;

      end if;

    end process subtract;

    changes_5((b + 1) * DIFFERENCE_WIDTH - 1 downto b * DIFFERENCE_WIDTH) <= change_5;

  end generate every_bank;

  --------------------------------------------------------------------------------------------------
  -- Read path: differences go from the banks to their outputs.

  read_place_at(1) <= read_place_1;
  read_slice_at(1) <= read_slice_1;

  wait_for_banks : process (clk) is
  begin

    if rising_edge(clk) then
      -- The last rotation belongs to the token whose differences come, so the token's place waits as long as they take.
      read_place_at(2 to CHANGED) <= read_place_at(1 to CHANGED - 1);
      read_slice_at(2 to 4)       <= read_slice_at(1 to 3);
    end if;

  end process wait_for_banks;

  to_places : entity work.bank_exchange
    generic map (
      BUILD => BUILD
    )
    port map (
      clk       => clk,
      slice     => read_slice_at(4),
      words_in  => changes_5,
      exchanged => exchanged
    );

  turned <= rotated(exchanged, read_place_at(CHANGED), DIFFERENCE_WIDTH);

  -- Banks beyond P belong to no output.
  give : process (clk) is
  begin

    if rising_edge(clk) then
      differences <= turned(P * DIFFERENCE_WIDTH - 1 downto 0);
    end if;

  end process give;

end architecture rtl;
