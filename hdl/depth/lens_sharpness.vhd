-- SPDX-License-Identifier: Apache-2.0
-- Sharpness of a slice around each micro image: absolute Laplacians between micro images, added over a window.
--
-- A scan goes over the sums of the newest complete row of micro images. The Laplacians are those of the row before it,
-- and the middle of the window lies RADIUS rows further back. After the last micro image the scan continues for 1 +
-- RADIUS clocks. Rows beyond the frame count as zero; right of the last micro image its sum is repeated.
--
-- Latency: SHARPNESS_LATENCY clocks, from a sum to the sharpness of the micro image 1 + RADIUS before it.
-- Throughput: one micro image each clock.
-- Equation: sharpness = sum over the window of
-- 4 L - L(up) - L(down) - L(left) - L(right)
-- , where a missing neighbour counts as L.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.index_pkg.all;
use work.sharpness_pkg.all;

entity lens_sharpness is
  generic (
    -- Sizes of sharpness_index.
    BUILD : index_build_t
  );
  port (
    clk : in    std_logic;
    -- Number of the sum's micro image, 2 clocks ahead; behind a scan's last one it stays.
    lens : in    unsigned(bits_for(BUILD.lenses - 1) - 1 downto 0);
    -- begins: the first sum of a scan; scans: any sum of a scan.
    begins : in    std_logic;
    scans  : in    std_logic;
    -- The sum of the newest row.
    sum : in    std_logic_vector(BUILD.sum_bits - 1 downto 0);
    -- About the row before the newest, whose Laplacians are computed: live: it belongs to a frame; joined_above,
    -- joined_below: its neighbours belong to the same frame.
    live         : in    std_logic;
    joined_above : in    std_logic;
    joined_below : in    std_logic;
    -- Which rows of the window (behind the newest) belong to the frame of the middle row, the newest in the low bit.
    same : in    std_logic_vector(2 * BUILD.radius downto 0);
    -- Number of the window's middle, 2 clocks ahead of the clock in which inner is set and the middle's row is added.
    inner_lens : in    unsigned(bits_for(BUILD.lenses - 1) - 1 downto 0);
    inner      : in    std_logic;
    -- The sharpness of the window's middle.
    sharpness : out   unsigned(BUILD.sharpness_bits - 1 downto 0)
  );
end entity lens_sharpness;

architecture rtl of lens_sharpness is

  constant SUM_BITS       : positive := BUILD.sum_bits;
  constant LAPLACIAN_BITS : positive := SUM_BITS + 2;
  constant ROW_BITS       : positive := BUILD.row_bits;
  constant ALL_BITS       : positive := BUILD.sharpness_bits;
  constant ADDRESS_BITS   : positive := bits_for(BUILD.lenses - 1);
  constant WINDOW         : positive := 2 * BUILD.radius + 1;

  subtype address_t is unsigned(ADDRESS_BITS - 1 downto 0);

  subtype sum_t is signed(SUM_BITS downto 0);

  subtype difference_t is signed(LAPLACIAN_BITS downto 0);

  subtype laplacian_t is unsigned(LAPLACIAN_BITS - 1 downto 0);

  type laplacians_t is array (natural range 1 to WINDOW) of laplacian_t;

  function wide (
    value : std_logic_vector
  ) return sum_t is
  begin

    -- The value as a signed number, for differences.
    return signed('0' & value);

  end function wide;

  -- The difference to a neighbour, or 0 if there is none.
  function difference (
    centre    : sum_t;
    neighbour : sum_t;
    there     : std_logic
  ) return difference_t is
  begin

    if there = '0' then
      return (others => '0');
    end if;

    return resize(centre - neighbour, LAPLACIAN_BITS + 1);

  end function difference;

  -- stored: the two rows before the newest; kept: the two rows to store for the next scan.
  signal stored : std_logic_vector(2 * SUM_BITS - 1 downto 0);
  signal kept   : std_logic_vector(2 * SUM_BITS - 1 downto 0);
  signal lens_1 : address_t := (others => '0');
  signal lens_2 : address_t := (others => '0');

  -- Sums one and two micro images back: of the newest row, of the row before it (centre), of the row before that
  -- (above).
  signal newest_1 : sum_t     := (others => '0');
  signal centre_1 : sum_t     := (others => '0');
  signal above_1  : sum_t     := (others => '0');
  signal centre_2 : sum_t     := (others => '0');
  signal has_1    : std_logic := '0';
  signal has_2    : std_logic := '0';

  -- The pipeline behind the sums: begin of a row; differences to the neighbours across and along the row; whether the
  -- micro image counts; their sum (bend) and its absolute value; the last Laplacians of the window, and their sum.
  signal begins_at  : std_logic_vector(1 to 4)        := (others => '0');
  signal across     : difference_t                    := (others => '0');
  signal along      : difference_t                    := (others => '0');
  signal there_1    : std_logic                       := '0';
  signal there_2    : std_logic                       := '0';
  signal bend       : difference_t                    := (others => '0');
  signal laplacian  : laplacian_t                     := (others => '0');
  signal laplacians : laplacians_t                    := (others => (others => '0'));
  signal row_sum    : unsigned(ROW_BITS - 1 downto 0) := (others => '0');
  signal total      : unsigned(ALL_BITS - 1 downto 0) := (others => '0');

begin

  -- The row to store becomes the last one, beside the row that was last before.
  kept <= stored(SUM_BITS - 1 downto 0) & sum;

  -- The last two rows of sums move on with each new sum, because a Laplacian needs the rows above and below.
  rows_before : entity work.ram_simple_dual_port
    generic map (
      WIDTH => 2 * SUM_BITS,
      WORDS => BUILD.lenses
    )
    port map (
      clk           => clk,
      write_enable  => scans,
      write_address => lens_2,
      write_data    => kept,
      read_address  => lens,
      read_data     => stored
    );

  judge_row : process (clk) is

    variable centre : sum_t;
    variable before : std_logic;

  begin

    if rising_edge(clk) then
      lens_1 <= lens;
      lens_2 <= lens_1;

      -- Clock 0: the sums. Their neighbours to the left are one and two clocks old.
      centre := wide(stored(SUM_BITS - 1 downto 0));
      -- With a scan's first sum the register still holds the row before, which is no neighbour.
      before := has_1 and not begins;

      newest_1 <= wide(sum);
      centre_1 <= centre;
      above_1  <= wide(stored(2 * SUM_BITS - 1 downto SUM_BITS));
      centre_2 <= centre_1;
      has_1    <= scans;
      has_2    <= before;

      -- A neighbour outside the frame counts as equal to the centre and adds no difference. There is always a neighbour
      -- to the right: behind the last micro image its own sum is repeated (see lens).
      along   <= difference(centre_1, centre_2, has_2) + resize(centre_1 - centre, LAPLACIAN_BITS + 1);
      across  <= difference(centre_1, above_1, joined_above) + difference(centre_1, newest_1, joined_below);
      there_1 <= before and live;

      -- Clocks 1 and 2: the absolute value. The sum of four differences takes two clocks, so that no clock has more
      -- than two additions in a row.
      bend    <= along + across;
      there_2 <= there_1;

      laplacian <= (others => '0');
      if there_2 = '1' then
        -- GHDL 2.0 would write abs to Verilog unchanged, so the sign is tested here.
        if bend(bend'high) = '1' then
          laplacian <= resize(unsigned(-bend), LAPLACIAN_BITS);
        else
          laplacian <= resize(unsigned(bend), LAPLACIAN_BITS);
        end if;
      end if;

      begins_at <= begins & begins_at(1 to 3);

      -- Clock 3: the window within the row. A new row begins with its first Laplacian alone.
      if begins_at(3) = '1' then
        laplacians <= (others => (others => '0'));
        row_sum    <= resize(laplacian, ROW_BITS);
      else
        -- In this running sum one Laplacian enters, and the one that is WINDOW older leaves. The sum stays below WINDOW
        -- times the largest Laplacian, which ROW_BITS holds.
        row_sum <= row_sum + laplacian - laplacians(WINDOW);

        for i in 2 to WINDOW loop

          laplacians(i) <= laplacians(i - 1);

        end loop;

      end if;
      laplacians(1) <= laplacian;
    end if;

  end process judge_row;

  sharpness <= total;

  -- Clock 4: the window over rows.
  one_row : if BUILD.radius = 0 generate

    add : process (clk) is
    begin

      if rising_edge(clk) then
        total <= resize(row_sum, ALL_BITS);
      end if;

    end process add;

  end generate one_row;

  several_rows : if BUILD.radius > 0 generate

    constant KEPT_BITS : positive := 2 * BUILD.radius * ROW_BITS;

    signal rows         : std_logic_vector(KEPT_BITS - 1 downto 0);
    signal moved        : std_logic_vector(KEPT_BITS + ROW_BITS - 1 downto 0);
    signal inner_lens_1 : address_t := (others => '0');
    signal inner_lens_2 : address_t := (others => '0');

  begin

    -- The rows before lie in one word, the oldest at the left; this row is appended.
    moved <= rows & std_logic_vector(row_sum);

    -- Sums of rows are stored instead of Laplacians: a window then takes one addition a row, whatever its width.
    row_sums : entity work.ram_simple_dual_port
      generic map (
        WIDTH => KEPT_BITS,
        WORDS => BUILD.lenses
      )
      port map (
        clk           => clk,
        write_enable  => inner,
        write_address => inner_lens_2,
        write_data    => moved(KEPT_BITS - 1 downto 0),
        read_address  => inner_lens,
        read_data     => rows
      );

    add : process (clk) is

      variable added : unsigned(ALL_BITS - 1 downto 0);

    begin

      if rising_edge(clk) then
        inner_lens_1 <= inner_lens;
        inner_lens_2 <= inner_lens_1;

        added := (others => '0');

        -- A row of another frame, or of none, adds nothing.
        for i in 0 to 2 * BUILD.radius loop

          if same(i) = '1' then
            added := added + unsigned(moved((i + 1) * ROW_BITS - 1 downto i * ROW_BITS));
          end if;

        end loop;

        total <= added;
      end if;

    end process add;

  end generate several_rows;

end architecture rtl;
