-- SPDX-License-Identifier: Apache-2.0
-- Interpolates the rows of a hexagonal grid to a rectangular raster: each of its micro images lies between two lenses
-- of its row.
--
-- Lenses with even and with odd numbers have two memories each, so that the same pixel of two neighbours is read in one
-- clock while the next lenses arrive.
--
-- Latency: 2 M + 7 clocks from the first pixel of a line. Throughput: one pixel out each clock.
-- Equation: p = place + n STEP; pixel(n) = floor(((1 - w) value(floor(p)) + w value(floor(p) + 1)) / 2**GUARD_BITS +
--   1/2), w the first WEIGHT_BITS bits of the fraction of p; saturated.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.resample_pkg.all;

entity hexagonal_rows is
  generic (
    -- Sizes of the resampler.
    BUILD : resample_build_t
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Registers, read with the first line of a frame.
    registers : in    registers_t;
    -- Values of pixels in; in_first: the first of a frame; in_last: the last of a line.
    in_valid : in    std_logic;
    in_ready : out   std_logic;
    in_first : in    std_logic;
    in_last  : in    std_logic;
    in_data  : in    std_logic_vector(BUILD.channels * BUILD.value_bits - 1 downto 0);
    -- Pixels out.
    m_axis_tvalid : out   std_logic;
    m_axis_tready : in    std_logic;
    m_axis_tdata  : out   std_logic_vector(BUILD.channels * BUILD.pixel_bits - 1 downto 0);
    m_axis_tuser  : out   std_logic_vector(0 downto 0);
    m_axis_tlast  : out   std_logic
  );
end entity hexagonal_rows;

architecture rtl of hexagonal_rows is

  constant DATA_BITS  : positive := BUILD.channels * BUILD.value_bits;
  constant OUT_BITS   : positive := BUILD.channels * BUILD.pixel_bits;
  constant LAST_PIXEL : natural  := BUILD.micro_image_size - 1;
  constant PIXEL_ADDR : positive := bits_for(larger(LAST_PIXEL, 1));
  -- Room for pixels that are under way between a read and the output, and for a sink that pauses.
  constant FIFO_BITS : positive := 4;
  -- Clocks from reading a pixel to its place in the output buffer.
  constant READ_LATENCY : positive := 5;

  -- The number of a lens counts on without end. Only differences below eight matter, so four bits are enough.
  subtype number_t is signed(3 downto 0);

  subtype pixel_index_t is natural range 0 to larger(LAST_PIXEL, 1);

  subtype weight_t is unsigned(BUILD.weight_bits - 1 downto 0);

  -- The word addresses in the memories of even and of odd lenses.
  type banks_t is array (0 to 1) of unsigned(PIXEL_ADDR downto 0);

  type words_t is array (0 to 1) of std_logic_vector(DATA_BITS - 1 downto 0);

  -- written: lenses that are complete; in_pixel: the pixel that comes in; take, taken: it is taken, and into which
  -- memory.
  signal written  : number_t      := (others => '0');
  signal in_pixel : pixel_index_t := 0;
  signal take     : std_logic;
  signal taken    : std_logic_vector(0 to 1);
  -- Which lenses are the first of a frame, by their numbers modulo 8.
  signal firsts : std_logic_vector(7 downto 0) := (others => '0');
  -- Four lenses are in memory, even and odd ones apart, so that two neighbours are read at once. The address is the
  -- lens's number without its lowest bit, then the pixel.
  signal in_bank : unsigned(PIXEL_ADDR downto 0);
  signal banks   : banks_t := (others => (others => '0'));
  signal word    : words_t;

  -- The line that goes out: number of its first lens; place of the micro image among the lenses; the lenses to its left
  -- and right.
  signal line_base    : number_t              := (others => '0');
  signal place        : position_t            := (others => '0');
  signal left_lens    : number_t;
  signal right_lens   : number_t;
  signal starts_line  : std_logic             := '1';
  signal starts_frame : std_logic;
  signal outputs_left : unsigned(15 downto 0) := (others => '0');
  signal out_pixel    : pixel_index_t         := 0;
  signal line_index   : pixel_index_t         := 0;
  -- The row of lenses (in odd rows the first lens lies half a pitch further on), and the registers as read with the
  -- frame's first line.
  signal row_odd    : std_logic;
  signal outputs    : unsigned(15 downto 0) := (others => '0');
  signal lenses     : unsigned(15 downto 0) := (others => '0');
  signal place_even : position_t            := (others => '0');
  signal place_odd  : position_t            := (others => '0');
  signal step       : position_t            := (others => '0');
  -- issue: a pixel is read. Behind the read: whether there is a pixel, whether it is a frame's first or a line's last.
  -- Only valid_at has a reset.
  signal issue    : std_logic                           := '0';
  signal issued   : std_logic                           := '0';
  signal valid_at : std_logic_vector(1 to READ_LATENCY) := (others => '0');
  signal first_at : std_logic_vector(1 to READ_LATENCY) := (others => '0');
  signal last_at  : std_logic_vector(1 to READ_LATENCY) := (others => '0');
  -- The weight of the right lens, and whether the left lens is in the odd memory, until the words come.
  signal weight_1 : weight_t  := (others => '0');
  signal weight_2 : weight_t  := (others => '0');
  signal weight_3 : weight_t  := (others => '0');
  signal odd_1    : std_logic := '0';
  signal odd_2    : std_logic := '0';
  signal odd_3    : std_logic := '0';
  signal blended  : std_logic_vector(OUT_BITS - 1 downto 0);
  -- Free places in the output FIFO. A read takes one at once, because everything behind a read goes on without
  -- stopping.
  signal room      : unsigned(FIFO_BITS downto 0) := to_unsigned(2 ** FIFO_BITS, FIFO_BITS + 1);
  signal fifo_in   : std_logic_vector(OUT_BITS + 1 downto 0);
  signal fifo_out  : std_logic_vector(OUT_BITS + 1 downto 0);
  signal out_valid : std_logic;

begin

  -- Input. At most four lenses are in memory, counted from the left one that is read: two are read, two arrive.
  take     <= '1' when in_valid = '1' and written - left_lens < 4 else
              '0';
  in_ready <= '1' when written - left_lens < 4 else
              '0';
  taken(0) <= take and not written(0);
  taken(1) <= take and written(0);
  in_bank  <= written(1) & to_unsigned(in_pixel, PIXEL_ADDR);

  -- Output. The integer part of the place says how many lenses the left lens lies behind the line's first lens.
  left_lens  <= line_base + place(BUILD.fraction_bits + number_t'length - 1 downto BUILD.fraction_bits);
  right_lens <= left_lens + 1;
  issue      <= '1' when starts_line = '0' and written - left_lens >= 2 and room /= 0 else
                '0';

  take_lenses : process (clk) is
  begin

    if rising_edge(clk) then
      -- Even and odd lenses go to their own memories, pixel after pixel.
      if take = '1' then
        if in_pixel = LAST_PIXEL then
          in_pixel <= 0;
          written  <= written + 1;
        else
          in_pixel <= in_pixel + 1;
        end if;
        if in_pixel = 0 then
          -- Noted with a lens's first pixel: the line that begins with this lens begins a frame.
          firsts(to_integer(unsigned(written(2 downto 0)))) <= in_first;
        end if;
      end if;

      if reset = '1' then
        written  <= (others => '0');
        in_pixel <= 0;
      end if;
    end if;

  end process take_lenses;

  follow : process (clk) is
  begin

    if rising_edge(clk) then
      -- A line begins as soon as its first lens is complete. Registers are read only now, because the frame before may
      -- still need them until its last line has gone out.
      if starts_line = '1' and written - line_base >= 1 then
        starts_line  <= '0';
        starts_frame <= firsts(to_integer(unsigned(line_base(2 downto 0))));
        -- The first line of a frame reads the registers; the following lines keep what was read.
        if firsts(to_integer(unsigned(line_base(2 downto 0)))) = '1' then
          outputs_left <= unsigned(registers(REGISTER_OUTPUTS)(15 downto 0));
          outputs      <= unsigned(registers(REGISTER_OUTPUTS)(15 downto 0));
          lenses       <= unsigned(registers(REGISTER_LENSES)(31 downto 16));
          place        <= signed(registers(REGISTER_PLACE_EVEN));
          place_even   <= signed(registers(REGISTER_PLACE_EVEN));
          place_odd    <= signed(registers(REGISTER_PLACE_ODD));
          step         <= signed(registers(REGISTER_STEP));
          line_index   <= 0;
          row_odd      <= '0';
        else
          outputs_left <= outputs;
          -- In odd rows the lenses lie half a pitch off, so the first micro image has another place among them.
          if row_odd = '0' then
            place <= place_even;
          else
            place <= place_odd;
          end if;
        end if;
      end if;

      -- Clock 1: reads.
      issued      <= issue;
      valid_at(1) <= '0';
      first_at(1) <= '0';
      last_at(1)  <= '0';
      -- Both memories are read at once. The even memory has the left lens, or the right one if the left is odd.
      banks(0) <= left_lens(1) & to_unsigned(out_pixel, PIXEL_ADDR);
      banks(1) <= left_lens(1) & to_unsigned(out_pixel, PIXEL_ADDR);
      if left_lens(0) = '1' then
        banks(0) <= right_lens(1) & to_unsigned(out_pixel, PIXEL_ADDR);
      end if;
      odd_1    <= left_lens(0);
      odd_2    <= odd_1;
      odd_3    <= odd_2;
      weight_1 <= unsigned(place(BUILD.fraction_bits - 1 downto BUILD.fraction_bits - BUILD.weight_bits));
      weight_2 <= weight_1;
      weight_3 <= weight_2;

      if issue = '1' then
        valid_at(1)  <= '1';
        first_at(1)  <= starts_frame;
        starts_frame <= '0';
        if out_pixel = LAST_PIXEL then
          out_pixel <= 0;
          -- Behind the last pixel of a micro image the place moves on by a step.
          place        <= place + step;
          outputs_left <= outputs_left - 1;
          -- The line has all its micro images: the next line begins with the next row's first lens.
          if outputs_left = 1 then
            last_at(1)  <= '1';
            starts_line <= '1';
            place       <= (others => '0');
            line_base   <= line_base + signed(lenses(3 downto 0));
            if line_index = LAST_PIXEL then
              line_index <= 0;
              row_odd    <= not row_odd;
            else
              line_index <= line_index + 1;
            end if;
          end if;
        else
          out_pixel <= out_pixel + 1;
        end if;
      end if;

      -- Free places in the output buffer. A read and a pixel that leaves in the same clock cancel out.
      if issue = '1' and not (out_valid = '1' and m_axis_tready = '1') then
        room <= room - 1;
      elsif issue = '0' and out_valid = '1' and m_axis_tready = '1' then
        room <= room + 1;
      end if;

      -- The registers need no reset, because the first lens after it is the first of a frame.
      if reset = '1' then
        line_base   <= (others => '0');
        place       <= (others => '0');
        starts_line <= '1';
        out_pixel   <= 0;
        valid_at(1) <= '0';
        first_at(1) <= '0';
        last_at(1)  <= '0';
        room        <= to_unsigned(2 ** FIFO_BITS, FIFO_BITS + 1);
      end if;
    end if;

  end process follow;

  -- Four lenses of M pixels in two memories: a ring of lenses, of which two are read and two are written.
  parities : for i in 0 to 1 generate

    words : entity work.ram_simple_dual_port
      generic map (
        WIDTH => DATA_BITS,
        WORDS => 2 ** (PIXEL_ADDR + 1)
      )
      port map (
        clk           => clk,
        write_enable  => taken(i),
        write_address => in_bank,
        write_data    => in_data,
        read_address  => banks(i),
        read_data     => word(i)
      );

  end generate parities;

  blend : for c in 0 to BUILD.channels - 1 generate

    constant SUM_BITS  : positive := BUILD.value_bits + BUILD.weight_bits;
    constant DROP_BITS : positive := BUILD.weight_bits + BUILD.guard_bits;

    signal left_value  : unsigned(BUILD.value_bits - 1 downto 0);
    signal right_value : unsigned(BUILD.value_bits - 1 downto 0);
    signal left_late   : unsigned(BUILD.value_bits - 1 downto 0)         := (others => '0');
    signal part        : signed(SUM_BITS + 1 downto 0)             := (others => '0');

  begin

    -- odd_3 says which memory holds the left lens.
    left_value  <= unsigned(word(0)((c + 1) * BUILD.value_bits - 1 downto c * BUILD.value_bits)) when odd_3 = '0' else
                   unsigned(word(1)((c + 1) * BUILD.value_bits - 1 downto c * BUILD.value_bits));
    right_value <= unsigned(word(1)((c + 1) * BUILD.value_bits - 1 downto c * BUILD.value_bits)) when odd_3 = '0' else
                   unsigned(word(0)((c + 1) * BUILD.value_bits - 1 downto c * BUILD.value_bits));

    interpolate : process (clk) is

      variable difference : signed(BUILD.value_bits downto 0);
      variable sum        : unsigned(SUM_BITS downto 0);
      variable whole      : unsigned(SUM_BITS + 1 downto 0);
      variable rounded    : unsigned(BUILD.pixel_bits - 1 downto 0);

    begin

      if rising_edge(clk) then
        -- left + w (right - left) takes one product instead of two.
        difference := signed('0' & right_value) - signed('0' & left_value);
        part       <= difference * signed('0' & weight_3);
        left_late  <= left_value;

        whole := "00" & left_late & to_unsigned(0, BUILD.weight_bits);
        -- Clock 2: the left value, shifted to the product's fraction bits, and the half for rounding.
        sum     := resize(unsigned(signed(whole) + part), SUM_BITS + 1);
        sum     := shift_right(sum + 2 ** (DROP_BITS - 1), DROP_BITS);
        rounded := sum(BUILD.pixel_bits - 1 downto 0);
        -- Values above full scale come from gains.
        if sum >= 2 ** BUILD.pixel_bits then
          blended((c + 1) * BUILD.pixel_bits - 1 downto c * BUILD.pixel_bits) <= (others => '1');
        else
          blended((c + 1) * BUILD.pixel_bits - 1 downto c * BUILD.pixel_bits) <= std_logic_vector(rounded);
        end if;
      end if;

    end process interpolate;

  end generate blend;

  follow_tags : process (clk) is
  begin

    if rising_edge(clk) then
      -- The marks wait as long as memories and interpolation take.
      valid_at(2 to READ_LATENCY) <= valid_at(1 to READ_LATENCY - 1);
      first_at(2 to READ_LATENCY) <= first_at(1 to READ_LATENCY - 1);
      last_at(2 to READ_LATENCY)  <= last_at(1 to READ_LATENCY - 1);
      if reset = '1' then
        valid_at(2 to READ_LATENCY) <= (others => '0');
      end if;
    end if;

  end process follow_tags;

  fifo_in <= last_at(READ_LATENCY) & first_at(READ_LATENCY) & blended;

  buffered : entity work.axis_fifo
    generic map (
      WIDTH        => OUT_BITS + 2,
      ADDRESS_BITS => FIFO_BITS,
      MUST_FIT     => true
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axis_tvalid => valid_at(READ_LATENCY),
      s_axis_tdata  => fifo_in,
      m_axis_tvalid => out_valid,
      m_axis_tready => m_axis_tready,
      m_axis_tdata  => fifo_out
    );

  m_axis_tvalid   <= out_valid;
  m_axis_tdata    <= fifo_out(OUT_BITS - 1 downto 0);
  m_axis_tuser(0) <= fifo_out(OUT_BITS);
  m_axis_tlast    <= fifo_out(OUT_BITS + 1);

end architecture rtl;
