-- SPDX-License-Identifier: Apache-2.0
-- Registers of a core behind AXI4-Lite: description, control, events, interrupt; and the gate that lets whole frames
-- in.
--
-- registers.toml beside this file is the map; docs/registers.md shows it as a table. SLVERR, without any effect,
-- answers accesses to registers of parts that are not built (PARTS), to addresses beyond the map, writes to read-only
-- registers and reads of write-only ones. A write-only register that shares 8 bytes with a readable one reads as 0,
-- because a bus of 64 bits reads both. A frame size that the core does not support is reported in `errors` instead,
-- because SLVERR may stop a processor.
--
-- Latency: 2 clocks from address and data of a write to the ports, 3 clocks for load words.
-- Throughput: a write and a read every 2 clocks.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.number_set_pkg.all;
use work.register_map_pkg.all;
use work.axi_pkg.all;
use work.token_pkg.marks_t;
use work.resample_pkg.load_t;

entity refocuser_registers is
  generic (
    -- Contents of the registers of these names (axi_pkg).
    PARTS      : natural;
    GEOMETRY   : natural;
    LIMITS     : natural;
    ENGINE     : natural := 0;
    SHARPNESS  : natural := 0;
    CONFIDENCE : natural := 0;
    RESAMPLER  : natural := 0;
    LENSES     : natural := 0;
    -- The set of slices, the weights of their sharpening and their boxes, as in raster_refocuser.
    SHIFTS     : string := "";
    SHARPENING : string := "";
    BOX        : string := ""
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- AXI4-Lite.
    s_axi_ctrl_request : in    bus_request_t;
    s_axi_ctrl_answer  : out   bus_answer_t;
    -- High while an event that is not masked out is pending.
    interrupt : out   std_logic;
    -- Orders to the core.
    orders : out   orders_t;
    -- Load port of a resampler.
    load : out   load_t;
    -- Faults from the core, each high for one clock, by the bits of `errors`.
    faults : in    std_logic_vector(5 downto 0);
    -- Size of the frames that come out of a resampler.
    raster_columns : in    std_logic_vector(15 downto 0) := (others => '0');
    raster_rows    : in    std_logic_vector(15 downto 0) := (others => '0');
    -- The stream in, the handshake of the core's input, and its output (frame_gate).
    s_axis_marks   : in    marks_t;
    s_axis_tready  : out   std_logic;
    core_tvalid    : out   std_logic;
    core_tready    : in    std_logic;
    m_axis_watched : in    watched_t
  );
end entity refocuser_registers;

architecture rtl of refocuser_registers is

  -- 4 KiB are 1024 words.
  constant PLACE_BITS : positive := 10;

  function to_word (
    value : natural
  ) return word_t is
  begin

    return std_logic_vector(to_unsigned(value, 32));

  end function to_word;

  constant READS  : registers_t := present_registers(PARTS, READABLE);
  constant PAIRED : registers_t := in_pairs(READS);
  constant WRITES : registers_t := present_registers(PARTS, WRITABLE);

  -- Content of slice_shift for each slice.
  constant SLICES : natural := slice_count(SHIFTS);

  subtype slice_words_t is words_t(0 to larger(SLICES, 1) - 1);

  function slice_words return slice_words_t is

    constant WEIGHTS : natural := slice_count(SHARPENING);
    constant BOXES   : natural := slice_count(BOX);

    variable words   : slice_words_t;
    variable shift   : signed(SLICE_SHIFT_SHIFT_BITS - 1 downto 0);
    variable weight  : unsigned(SLICE_SHIFT_SHARPENING_BITS - 1 downto 0);
    variable samples : unsigned(SLICE_SHIFT_BOX_BITS - 1 downto 0);

  begin

    -- Unused bits are zero, and so are all weights if nothing is sharpened, and all boxes if they are M.
    words   := (others => (others => '0'));
    weight  := (others => '0');
    samples := (others => '0');

    for i in 0 to SLICES - 1 loop

      shift := to_signed(slice_shift(SHIFTS, i), shift'length);

      if i < WEIGHTS then
        weight := to_unsigned(slice_shift(SHARPENING, i), weight'length);
      end if;

      -- One number stands for all slices.
      if BOXES > 0 then
        samples := to_unsigned(slice_shift(BOX, choose(BOXES = 1, 0, i)), samples'length);
      end if;

      words(i) := std_logic_vector(resize(samples & weight & unsigned(shift), 32));

    end loop;

    return words;

  end function slice_words;

  constant SLICE_WORDS_OF_SET : slice_words_t := slice_words;

  -- Taken from the registers' contents, so that each limit is given once.
  constant MAX_COLUMNS      : natural := (LIMITS / 2 ** LIMITS_MAX_COLUMNS) mod 2 ** LIMITS_MAX_COLUMNS_BITS;
  constant PIXELS_PER_CLOCK : natural := GEOMETRY / 2 ** GEOMETRY_PIXELS_PER_CLOCK;

  -- Load words are written whole. The last of their kinds stands for the commit, which a command gives.
  constant ALL_BYTES   : std_logic_vector(3 downto 0) := "1111";
  constant COMMIT_KIND : std_logic_vector(1 downto 0) := "11";

  constant COUNTERS : positive := AT_DROPPED - AT_FRAMES_IN + 1;

  signal write         : std_logic;
  signal write_place   : unsigned(PLACE_BITS - 1 downto 0);
  signal write_bytes   : std_logic_vector(3 downto 0);
  signal write_data    : word_t;
  signal write_refused : std_logic;
  signal read_place    : unsigned(PLACE_BITS - 1 downto 0);
  signal read_data     : word_t;
  signal read_refused  : std_logic;

  -- written: the register that is written in this clock; ones: its value in the bytes that are written; whole: all
  -- bytes are.
  signal written : registers_t;
  signal ones    : word_t;
  signal whole   : std_logic;

  -- words: what each register reads as; kept_words: values that registers keep.
  signal words       : words_t(0 to REGISTERS_TOTAL - 1);
  signal kept_words  : words_t(0 to REGISTERS_TOTAL - 1) := (others => (others => '0'));
  signal slice_word  : word_t;
  signal size_good   : std_logic;
  signal restart_now : std_logic                         := '0';
  signal restarts    : std_logic;
  signal enabled     : std_logic;
  signal frame_size  : word_t;

  -- Events at the core in this clock, and those that are recorded.
  signal busy      : std_logic;
  signal traffic   : traffic_t;
  signal out_slice : std_logic_vector(7 downto 0) := (others => '0');

  signal refused        : std_logic;
  signal new_errors     : std_logic_vector(6 downto 0);
  signal clear_errors   : std_logic_vector(6 downto 0);
  signal clear_happened : std_logic_vector(2 downto 0);
  signal errors         : std_logic_vector(6 downto 0);
  signal happened       : std_logic_vector(2 downto 0);
  signal events         : std_logic_vector(0 to COUNTERS - 1);
  signal counts         : words_t(0 to COUNTERS - 1);

  signal load_place : unsigned(LOAD_PLACE_KIND + LOAD_PLACE_KIND_BITS - 1 downto 0) := (others => '0');

begin

  bus_side : entity work.axi_lite_slave
    generic map (
      ADDRESS_BITS => PLACE_BITS + 2
    )
    port map (
      clk           => clk,
      reset         => reset,
      s_axi_awaddr  => s_axi_ctrl_request.awaddr,
      s_axi_awvalid => s_axi_ctrl_request.awvalid,
      s_axi_awready => s_axi_ctrl_answer.awready,
      s_axi_wdata   => s_axi_ctrl_request.wdata,
      s_axi_wstrb   => s_axi_ctrl_request.wstrb,
      s_axi_wvalid  => s_axi_ctrl_request.wvalid,
      s_axi_wready  => s_axi_ctrl_answer.wready,
      s_axi_bresp   => s_axi_ctrl_answer.bresp,
      s_axi_bvalid  => s_axi_ctrl_answer.bvalid,
      s_axi_bready  => s_axi_ctrl_request.bready,
      s_axi_araddr  => s_axi_ctrl_request.araddr,
      s_axi_arvalid => s_axi_ctrl_request.arvalid,
      s_axi_arready => s_axi_ctrl_answer.arready,
      s_axi_rdata   => s_axi_ctrl_answer.rdata,
      s_axi_rresp   => s_axi_ctrl_answer.rresp,
      s_axi_rvalid  => s_axi_ctrl_answer.rvalid,
      s_axi_rready  => s_axi_ctrl_request.rready,
      write         => write,
      write_place   => write_place,
      write_bytes   => write_bytes,
      write_data    => write_data,
      write_refused => write_refused,
      read_place    => read_place,
      read_data     => read_data,
      read_refused  => read_refused
    );

  gate : entity work.frame_gate
    generic map (
      MAX_COLUMNS      => MAX_COLUMNS,
      PIXELS_PER_CLOCK => PIXELS_PER_CLOCK
    )
    port map (
      clk            => clk,
      reset          => restarts,
      enable         => enabled,
      columns        => frame_size(FRAME_SIZE_COLUMNS + 15 downto FRAME_SIZE_COLUMNS),
      rows           => frame_size(FRAME_SIZE_ROWS + 15 downto FRAME_SIZE_ROWS),
      s_axis_marks   => s_axis_marks,
      s_axis_tready  => s_axis_tready,
      core_tvalid    => core_tvalid,
      core_tready    => core_tready,
      m_axis_watched => m_axis_watched,
      busy           => busy,
      traffic        => traffic
    );

  --------------------------------------------------------------------------------------------------
  -- Address decoding.

  -- One loop serves all registers: READS and WRITES are constants, so synthesis removes what the map does not allow.
  decode : process (write, write_place, write_bytes, write_data, read_place, words) is
  begin

    -- An access is refused unless a register accepts it, so holes of the map and missing parts need no case of their
    -- own.
    write_refused <= '1';
    written       <= (others => '0');
    read_refused  <= '1';
    read_data     <= (others => '0');

    for i in 0 to REGISTERS_TOTAL - 1 loop

      if write_place = i and WRITES(i) = '1' then
        write_refused <= '0';
        written(i)    <= write;
      end if;

      if read_place = i and PAIRED(i) = '1' then
        read_refused <= '0';
        if READS(i) = '1' then
          read_data <= words(i);
        end if;
      end if;

    end loop;

    -- For registers that act on bits written as 1: a byte that the bus does not write counts as 0.
    ones <= (others => '0');

    for i in 0 to 3 loop

      if write_bytes(i) = '1' then
        ones(8 * i + 7 downto 8 * i) <= write_data(8 * i + 7 downto 8 * i);
      end if;

    end loop;

  end process decode;

  whole <= '1' when write_bytes = ALL_BYTES else
           '0';

  --------------------------------------------------------------------------------------------------
  -- Reading.

  -- What each register reads as, by its name; the map says which registers exist.
  words(AT_IDENTIFICATION) <= IDENTIFICATION_WORD;
  words(AT_VERSION)        <= VERSION_WORD;
  words(AT_PARTS)          <= to_word(PARTS);
  words(AT_GEOMETRY)       <= to_word(GEOMETRY);
  words(AT_LIMITS)         <= to_word(LIMITS);
  words(AT_ENGINE)         <= to_word(ENGINE);
  words(AT_SHARPNESS)      <= to_word(SHARPNESS);
  words(AT_CONFIDENCE)     <= to_word(CONFIDENCE);
  words(AT_RESAMPLER)      <= to_word(RESAMPLER);
  words(AT_LENSES)         <= to_word(LENSES);
  words(AT_ASKED_SLICE)    <= kept_words(AT_ASKED_SLICE);
  words(AT_SLICE_SHIFT)    <= slice_word;
  words(AT_CONTROL)        <= kept_words(AT_CONTROL);
  words(AT_COMMAND)        <= (others => '0');
  words(AT_SLICE)          <= kept_words(AT_SLICE);
  words(AT_SWEEP_FRAMES)   <= kept_words(AT_SWEEP_FRAMES);
  words(AT_FRAME_SIZE)     <= kept_words(AT_FRAME_SIZE);
  words(AT_RED_PLACE)      <= kept_words(AT_RED_PLACE);
  -- Bit `inside` lies above the slice, where the map has it.
  words(AT_STATUS)           <= std_logic_vector(resize(unsigned(busy & out_slice), 32));
  words(AT_RASTER_SIZE)      <= raster_rows & raster_columns;
  words(AT_ERRORS)           <= std_logic_vector(resize(unsigned(errors), 32));
  words(AT_INTERRUPT_STATUS) <= std_logic_vector(resize(unsigned(happened), 32));
  words(AT_INTERRUPT_MASK)   <= kept_words(AT_INTERRUPT_MASK);
  words(AT_LOAD_PLACE)       <= std_logic_vector(resize(load_place, 32));
  words(AT_LOAD_HIGH)        <= kept_words(AT_LOAD_HIGH);
  words(AT_LOAD_WORD)        <= (others => '0');

  show_counts : for i in AT_FRAMES_IN to AT_DROPPED generate
    words(i) <= counts(i - AT_FRAMES_IN);
  end generate show_counts;

  -- A multiplexer by comparison: software may ask for any number, and numbers beyond the set read as 0.
  show_slice : process (kept_words(AT_ASKED_SLICE)) is
  begin

    slice_word <= (others => '0');

    for i in 0 to SLICES - 1 loop

      if unsigned(kept_words(AT_ASKED_SLICE)) = i then
        slice_word <= SLICE_WORDS_OF_SET(i);
      end if;

    end loop;

  end process show_slice;

  --------------------------------------------------------------------------------------------------
  -- Writing.

  restarts   <= reset or restart_now;
  enabled    <= kept_words(AT_CONTROL)(CONTROL_ENABLE);
  frame_size <= kept_words(AT_FRAME_SIZE);

  orders <=
  (
    restart      => restarts,
    columns      => frame_size(FRAME_SIZE_COLUMNS + 15 downto FRAME_SIZE_COLUMNS),
    rows         => frame_size(FRAME_SIZE_ROWS + 15 downto FRAME_SIZE_ROWS),
    slice        => kept_words(AT_SLICE)(7 downto 0),
    sweep        => kept_words(AT_CONTROL)(CONTROL_SWEEP),
    sweep_frames => kept_words(AT_SWEEP_FRAMES)(7 downto 0),
    red_place    => kept_words(AT_RED_PLACE)(RED_PLACE_ROW) & kept_words(AT_RED_PLACE)(RED_PLACE_COLUMN)
  );

  -- A size must be written whole and while no frame can go in. It is checked when written, so the stored size is always
  -- valid.
  size_good <= '1' when whole = '1' and enabled = '0' and
                        unsigned(write_data(15 downto 0)) /= 0 and unsigned(write_data(15 downto 0)) <= MAX_COLUMNS and
                        unsigned(write_data(31 downto 16)) /= 0 else
               '0';

  keep : process (clk) is
  begin

    if rising_edge(clk) then

      for i in 0 to REGISTERS_TOTAL - 1 loop

        -- Bytes are written one by one, because the bus may write some of them alone; bits that the map does not keep
        -- stay 0.
        for b in 0 to 3 loop

          if written(i) = '1' and write_bytes(b) = '1' and (i /= AT_FRAME_SIZE or size_good = '1') then
            kept_words(i)(8 * b + 7 downto 8 * b) <= write_data(8 * b + 7 downto 8 * b) and
                                                     KEPT(i)(8 * b + 7 downto 8 * b);
          end if;

        end loop;

      end loop;

      -- A new size restarts the core, because its content belongs to the old size, and half a frame of each size would
      -- come out. The restart lasts one clock.
      restart_now <= (written(AT_COMMAND) and ones(COMMAND_RESTART)) or (written(AT_FRAME_SIZE) and size_good);

      if reset = '1' then
        kept_words  <= (others => (others => '0'));
        restart_now <= '0';
      end if;
    end if;

  end process keep;

  --------------------------------------------------------------------------------------------------
  -- Events.

  -- Refused without SLVERR: a frame size that is not supported, and parts of load words.
  refused <= (written(AT_FRAME_SIZE) and not size_good) or
             ((written(AT_LOAD_PLACE) or written(AT_LOAD_WORD)) and not whole) or
             (written(AT_LOAD_PLACE) and write_data(LOAD_PLACE_KIND) and write_data(LOAD_PLACE_KIND + 1));

  -- Events in the order of their registers.
  events <= traffic.frame_in & traffic.frame_out & traffic.line_in & traffic.line_out & traffic.stall_in &
            traffic.stall_out & traffic.dropped;

  happenings : entity work.event_registers
    generic map (
      COUNTERS => COUNTERS
    )
    port map (
      clk            => clk,
      reset          => restarts,
      events         => events,
      frame_in       => traffic.frame_in,
      frame_out      => traffic.frame_out,
      new_errors     => new_errors,
      clear_errors   => clear_errors,
      clear_happened => clear_happened,
      mask           => kept_words(AT_INTERRUPT_MASK)(2 downto 0),
      errors         => errors,
      happened       => happened,
      interrupt      => interrupt,
      counts         => counts
    );

  -- A refused write sets an error like a fault of the stream, so software that does not read back learns of it.
  new_errors     <= refused & faults;
  clear_errors   <= ones(6 downto 0) when written(AT_ERRORS) = '1' else
                    (others => '0');
  clear_happened <= ones(2 downto 0) when written(AT_INTERRUPT_STATUS) = '1' else
                    (others => '0');

  follow_slice : process (clk) is
  begin

    if rising_edge(clk) then
      -- A pixel on offer is enough: software wants to know the slice that comes next, too.
      if m_axis_watched.tvalid = '1' then
        out_slice <= m_axis_watched.tid;
      end if;
    end if;

  end process follow_slice;

  --------------------------------------------------------------------------------------------------
  -- Load port.

  give_load : process (clk) is
  begin

    if rising_edge(clk) then
      -- A load word is valid for one clock only.
      load.write   <= '0';
      load.kind    <= std_logic_vector(load_place(LOAD_PLACE_KIND + 1 downto LOAD_PLACE_KIND));
      load.address <= std_logic_vector(load_place(LOAD_PLACE_ADDRESS_BITS - 1 downto 0));
      load.data    <= kept_words(AT_LOAD_HIGH)(7 downto 0) & write_data;

      -- The address increments itself, so that a table is loaded by writing one register repeatedly.
      if written(AT_LOAD_WORD) = '1' and whole = '1' then
        load.write                                       <= '1';
        load_place(LOAD_PLACE_ADDRESS_BITS - 1 downto 0) <= load_place(LOAD_PLACE_ADDRESS_BITS - 1 downto 0) + 1;
      end if;
      if written(AT_LOAD_PLACE) = '1' and refused = '0' then
        load_place <= unsigned(write_data(load_place'range));
      end if;
      -- The commit takes the path of the words, so it cannot overtake them.
      if written(AT_COMMAND) = '1' and ones(COMMAND_COMMIT) = '1' then
        load.write <= '1';
        load.kind  <= COMMIT_KIND;
      end if;

      if reset = '1' then
        load.write <= '0';
        load_place <= (others => '0');
      end if;
    end if;

  end process give_load;

end architecture rtl;
