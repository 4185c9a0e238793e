-- A pass of the refocusing operator over rows or columns: re-ordering and moving sum.
--
-- The pixels themselves are kept until they have left the sum, each phase (index mod M) for only as long
-- as its age says; the sum takes one pixel in and gives one back at each step, whatever M and a' are.
-- A group of g = gcd(a', M) equal outputs is held. DEPTH = 1 filters rows, a token being a step, its memory a
-- ring of the last pixels; DEPTH > 1 filters columns, a line being a step, its memory a ring of lines for each phase.
-- A ring's lines lie in two banks in turn, so that the line that enters and the one that leaves,
-- neighbours in the ring, are read at the same time.
--
-- Lines (for columns: frames) must begin output_delay + 1 steps apart, frames as many lines as they have, rounded up
-- to a multiple of M; with ANY_ROWS least_frame lines, or as many as they have. The sequencer appends empty ones.
--
-- Latency: output_delay steps and sum_stage_latency clocks. Throughput: one token each clock; with DEPTH > 1
--   the same column comes again PARTIAL_SUM_LOOP clocks later at the earliest.
-- Ports: strobe marks a token, pixel those that the filter works on, advance the ones that begin a step, first
--   (with advance) the first step of a line, when slice is read; data the lanes. Bit 0 of step_tag marks steps with a
--   pixel of the line (the image). Side information: step_tag, taken with
--   advance, comes out output_delay steps later and holds until the next step; token_tag comes out with the token.
-- Equation: sum += entering pixel - leaving pixel; see moving_sum_pkg.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.refocus_pkg.all;
use work.moving_sum_pkg.all;

entity moving_sum_stage is
  generic (
    -- M.
    MICRO_IMAGE_SIZE : positive;
    -- As in raster_refocuser.
    SHIFTS : string;
    -- As in raster_refocuser.
    CENTRED : boolean;
    -- Columns only: whether frames of any number of lines follow each other without a gap.
    ANY_ROWS : boolean := false;
    -- Rows only: the slice, if it is always the same; -1: `slice`.
    FIXED_SLICE : integer := -1;
    -- 1 for rows, the longest line for columns.
    DEPTH : positive;
    -- Pixels of a token.
    LANES : positive;
    -- Width of a lane of the input.
    DATA_BITS : positive;
    -- Whether the input is multiplied by stored products.
    STORED : boolean;
    -- Stored products: fraction bits of the products above those of the input.
    SCALE_BITS : natural;
    -- Largest input of the sums.
    PRODUCT_MAX : natural;
    -- Largest sum: M times the largest input.
    SUM_MAX : natural;
    -- Stored products: fraction bits to drop from the sums.
    DROP_BITS : natural;
    -- Width of a lane of the output.
    RESULT_BITS : positive;
    -- Width of the side information of a step.
    STEP_TAG_BITS : positive;
    -- Width of the side information of a token.
    TOKEN_TAG_BITS : positive
  );
  port (
    clk           : in    std_logic;
    reset         : in    std_logic;
    strobe        : in    std_logic;
    pixel         : in    std_logic;
    advance       : in    std_logic;
    first         : in    std_logic;
    slice         : in    unsigned(bits_for(slice_count(SHIFTS) - 1) - 1 downto 0);
    data          : in    std_logic_vector(LANES * DATA_BITS - 1 downto 0);
    step_tag      : in    std_logic_vector(STEP_TAG_BITS - 1 downto 0);
    token_tag     : in    std_logic_vector(TOKEN_TAG_BITS - 1 downto 0);
    out_strobe    : out   std_logic;
    out_data      : out   std_logic_vector(LANES * RESULT_BITS - 1 downto 0);
    out_step_tag  : out   std_logic_vector(STEP_TAG_BITS - 1 downto 0);
    out_token_tag : out   std_logic_vector(TOKEN_TAG_BITS - 1 downto 0)
  );
end entity moving_sum_stage;

architecture rtl of moving_sum_stage is

  constant M            : positive := MICRO_IMAGE_SIZE;
  constant DELAY        : natural  := output_delay(M, SHIFTS, CENTRED);
  constant REACHED      : natural  := reach(M, SHIFTS, CENTRED);
  constant LATENCY      : positive := sum_stage_latency(STORED, DEPTH);
  constant PRODUCT_BITS : positive := bits_for(PRODUCT_MAX);
  constant SUM_BITS     : positive := bits_for(SUM_MAX);
  constant PIXEL_BITS   : positive := LANES * PRODUCT_BITS;
  constant SUMS_BITS    : positive := LANES * SUM_BITS;
  constant SLOT_BITS    : positive := bits_for(DEPTH - 1);

  constant LEAVING : boolean := pixels_leave(M, SHIFTS);
  constant HOLDING : boolean := holds_outputs(M, SHIFTS);
  constant SPLIT   : boolean := begins_within_group(M, SHIFTS, CENTRED);

  subtype pixels_t is std_logic_vector(PIXEL_BITS - 1 downto 0);

  subtype sums_t is std_logic_vector(SUMS_BITS - 1 downto 0);

  -- What the control says of a token, as it goes along with it.
  type orders_t is record
    active    : std_logic;
    fresh     : std_logic;
    to_first  : std_logic;
    to_held   : std_logic;
    enter     : std_logic;
    enter_now : std_logic;
    leave     : std_logic;
    take      : std_logic;
    clear     : std_logic;
    update    : std_logic;
    due       : std_logic;
  end record orders_t;

  constant NO_ORDERS : orders_t := (others => '0');

  type pipeline_t is array (natural range <>) of orders_t;

  type slots_t is array (natural range <>) of unsigned(SLOT_BITS - 1 downto 0);

  type words_t is array (natural range <>) of pixels_t;

  -- Clocks from a token to the addresses of the memories, and from there to their words.
  constant ADDRESS_CLOCKS : positive := 5;
  constant READ_CLOCKS    : positive := choose(DEPTH > 1, 3, 2);

  -- What the control says of a token belongs to the memories' addresses at index 2, to their words at ADD_CHANGES.
  constant ADD_CHANGES : positive := 2 + READ_CLOCKS;
  constant ADD_SUMS    : positive := ADD_CHANGES + 1;
  constant SHOW        : positive := ADD_CHANGES + 2;
  constant SHOWN       : positive := ADD_CHANGES + 3;

  signal pixels         : pixels_t;
  signal active_delayed : std_logic_vector(0 downto 0);
  signal active_tag     : std_logic_vector(0 downto 0);
  signal fresh          : std_logic;
  signal to_first       : std_logic;
  signal to_held        : std_logic;
  signal enter_age      : natural range 0 to REACHED;
  signal enter          : std_logic;
  signal enter_now      : std_logic;
  signal leave          : std_logic;
  signal take           : std_logic;
  signal clear          : std_logic;
  signal update         : std_logic;
  signal due            : std_logic;
  signal step_1         : std_logic;
  signal phase_1        : natural range 0 to M - 1;
  signal first_1        : std_logic;
  signal live_1         : std_logic;
  signal take_1         : std_logic;
  signal slice_1        : unsigned(slice'range);
  signal step_after     : std_logic;
  signal enter_phase_2  : natural range 0 to M - 1;
  signal moves_3        : std_logic;

  -- Orders and columns of a token, from 3 clocks behind its input on, and its own pixels.
  signal order_in  : orders_t;
  signal slot_in   : unsigned(SLOT_BITS - 1 downto 0);
  signal order     : pipeline_t(1 to SHOWN)    := (others => NO_ORDERS);
  signal slot      : slots_t(1 to SHOWN)       := (others => (others => '0'));
  signal pixels_at : words_t(0 to READ_CLOCKS) := (others => (others => '0'));
  signal entering  : pixels_t;
  signal going     : pixels_t;
  -- Sums of output 0 of the line that comes in (as they go on, and as it shows), sums, results; and what they
  -- were with the last step.
  signal changes     : sums_t := (others => '0');
  signal first_sums  : sums_t := (others => '0');
  signal held_sums   : sums_t := (others => '0');
  signal held_before : sums_t := (others => '0');
  signal sums        : sums_t := (others => '0');
  signal results     : sums_t := (others => '0');
  signal old_first   : sums_t;
  signal old_held    : sums_t := (others => '0');
  signal old_sums    : sums_t;
  signal old_results : sums_t := (others => '0');

  signal step         : std_logic;
  signal step_in      : std_logic_vector(0 downto 0);
  signal step_2       : std_logic_vector(0 downto 0);
  signal strobe_in    : std_logic_vector(0 downto 0);
  signal strobe_due   : std_logic_vector(0 downto 0);
  signal step_tag_2   : std_logic_vector(STEP_TAG_BITS - 1 downto 0);
  signal step_tag_due : std_logic_vector(STEP_TAG_BITS - 1 downto 0);

  -- For a lane of a word.

  function lane_of (
    word  : std_logic_vector;
    index : natural;
    width : positive
  ) return unsigned is
  begin

    return unsigned(word((index + 1) * width - 1 downto index * width));

  end function lane_of;

begin

  --------------------------------------------------------------------------------------------------
  -- Input: scaling, and the delay until the control knows.

  lane : for i in 0 to LANES - 1 generate

    signal value : std_logic_vector(DATA_BITS - 1 downto 0);

  begin

    value <= data((i + 1) * DATA_BITS - 1 downto i * DATA_BITS);

    stored_products : if STORED generate

      signal product : std_logic_vector(PRODUCT_BITS - 1 downto 0);

    begin

      product_rom : entity work.stored_product
        generic map (
          VALUE_BITS   => DATA_BITS,
          PRODUCT_BITS => PRODUCT_BITS,
          SCALE_BITS   => SCALE_BITS,
          DIVISOR      => MICRO_IMAGE_SIZE
        )
        port map (
          clk     => clk,
          value   => value,
          product => product
        );

      delay_product : entity work.tag_delay
        generic map (
          WIDTH  => PRODUCT_BITS,
          LENGTH => ADDRESS_CLOCKS - 1
        )
        port map (
          clk     => clk,
          reset   => '0',
          enable  => '1',
          tag     => product,
          delayed => pixels((i + 1) * PRODUCT_BITS - 1 downto i * PRODUCT_BITS)
        );

      round_sum : entity work.round_saturate
        generic map (
          VALUE_MAX   => SUM_MAX,
          DROP_BITS   => DROP_BITS,
          RESULT_BITS => RESULT_BITS
        )
        port map (
          clk    => clk,
          value  => results((i + 1) * SUM_BITS - 1 downto i * SUM_BITS),
          result => out_data((i + 1) * RESULT_BITS - 1 downto i * RESULT_BITS)
        );

    end generate stored_products;

    plain_values : if not STORED generate

      delay_value : entity work.tag_delay
        generic map (
          WIDTH  => DATA_BITS,
          LENGTH => ADDRESS_CLOCKS
        )
        port map (
          clk     => clk,
          reset   => '0',
          enable  => '1',
          tag     => value,
          delayed => pixels((i + 1) * PRODUCT_BITS - 1 downto i * PRODUCT_BITS)
        );

      out_data((i + 1) * RESULT_BITS - 1 downto i * RESULT_BITS) <= results((i + 1) * SUM_BITS - 1 downto i * SUM_BITS);

    end generate plain_values;

  end generate lane;

  control : entity work.moving_sum_control
    generic map (
      MICRO_IMAGE_SIZE => MICRO_IMAGE_SIZE,
      SHIFTS           => SHIFTS,
      CENTRED          => CENTRED,
      FIXED_SLICE      => FIXED_SLICE
    )
    port map (
      clk           => clk,
      reset         => reset,
      advance       => step,
      first         => first,
      live          => step_tag(0),
      slice         => slice,
      step_1        => step_1,
      phase_1       => phase_1,
      first_1       => first_1,
      live_1        => live_1,
      take_1        => take_1,
      slice_1       => slice_1,
      step_2        => step_after,
      enter_phase_2 => enter_phase_2,
      moves_3       => moves_3,
      fresh         => fresh,
      to_first      => to_first,
      to_held       => to_held,
      enter_age     => enter_age,
      enter         => enter,
      enter_now     => enter_now,
      leave         => leave,
      take          => take,
      clear         => clear,
      update        => update,
      due           => due
    );

  active_tag(0) <= strobe and pixel;

  delay_active : entity work.tag_delay
    generic map (
      WIDTH  => 1,
      LENGTH => ADDRESS_CLOCKS - 2
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => active_tag,
      delayed => active_delayed
    );

  order_in <=
  (
    active    => active_delayed(0),
    fresh     => fresh,
    to_first  => to_first,
    to_held   => to_held,
    enter     => enter,
    enter_now => enter_now,
    leave     => leave,
    take      => take,
    clear     => clear,
    update    => update,
    due       => due
  );

  pixels_at(0) <= pixels;

  go_along : process (clk) is
  begin

    if rising_edge(clk) then
      order(1)                    <= order_in;
      order(2 to SHOWN)           <= order(1 to SHOWN - 1);
      slot(1)                     <= slot_in;
      slot(2 to SHOWN)            <= slot(1 to SHOWN - 1);
      pixels_at(1 to READ_CLOCKS) <= pixels_at(0 to READ_CLOCKS - 1);
      if reset = '1' then

        for i in 1 to SHOWN loop

          order(i).active <= '0';

        end loop;

      end if;
    end if;

  end process go_along;

  --------------------------------------------------------------------------------------------------
  -- The pixels that are in use, and which of them enter and leave (READ_CLOCKS behind the addresses).

  pixel_memory : if DEPTH = 1 generate

    constant ADDRESS_BITS : positive := bits_for(REACHED);

    subtype address_t is unsigned(ADDRESS_BITS - 1 downto 0);

    signal write_address : address_t := (others => '0');
    signal enter_address : address_t := (others => '0');
    signal leave_address : address_t := (others => '0');
    signal age_at        : natural range 0 to REACHED;

  begin

    slot_in <= (others => '0');

    -- A step each token: ages count back from the place that is written.
    find_addresses : process (clk) is
    begin

      if rising_edge(clk) then
        age_at <= enter_age;
        if order(2).active = '1' then
          write_address <= write_address + 1;
          enter_address <= write_address + 1 - to_unsigned(age_at, ADDRESS_BITS);
          leave_address <= write_address + 1 - to_unsigned((age_at + M) mod 2 ** ADDRESS_BITS, ADDRESS_BITS);
        else
          enter_address <= write_address - to_unsigned(age_at, ADDRESS_BITS);
          leave_address <= write_address - to_unsigned((age_at + M) mod 2 ** ADDRESS_BITS, ADDRESS_BITS);
        end if;
      end if;

    end process find_addresses;

    entering_pixels : entity work.ram_simple_dual_port
      generic map (
        WIDTH        => PIXEL_BITS,
        ADDRESS_BITS => ADDRESS_BITS,
        READ_LATENCY => 2
      )
      port map (
        clk           => clk,
        write_enable  => order(2).active,
        write_address => write_address,
        write_data    => pixels_at(0),
        read_enable   => '1',
        read_address  => enter_address,
        read_data     => entering
      );

    pixels_leave_again : if LEAVING generate

      leaving_pixels : entity work.ram_simple_dual_port
        generic map (
          WIDTH        => PIXEL_BITS,
          ADDRESS_BITS => ADDRESS_BITS,
          READ_LATENCY => 2
        )
        port map (
          clk           => clk,
          write_enable  => order(2).active,
          write_address => write_address,
          write_data    => pixels_at(0),
          read_enable   => '1',
          read_address  => leave_address,
          read_data     => going
        );

    end generate pixels_leave_again;

  end generate pixel_memory;

  line_memory : if DEPTH > 1 generate

    constant SLICES    : positive := slice_count(SHIFTS);
    constant BANKS     : positive := choose(LEAVING, 2, 1);
    constant ALL_LINES : natural  := bank_lines(M, SHIFTS, CENTRED, ANY_ROWS, M);
    constant WORDS     : positive := choose(ALL_LINES = 0, 1, ALL_LINES) * DEPTH;
    constant WORD_BITS : positive := bits_for(WORDS - 1);

    subtype ring_t is natural range 0 to choose(ALL_LINES = 0, 1, BANKS * ALL_LINES);

    -- By phase.
    constant SLICE_STEP : positive := phase_words(M);

    type rings_t is array (natural range 0 to SLICE_STEP - 1) of ring_t;

    -- By slice and phase.
    type places_t is array (natural range 0 to table_words(M, SHIFTS) - 1) of ring_t;

    subtype word_address_t is unsigned(WORD_BITS - 1 downto 0);

    type word_addresses_t is array (natural range 0 to BANKS - 1) of word_address_t;

    type bank_words_t is array (natural range 0 to 1) of pixels_t;

    function ring_table return rings_t is

      variable table : rings_t;

    begin

      table := (others => 1);

      for v in 0 to M - 1 loop

        table(v) := ring_lines(M, SHIFTS, CENTRED, ANY_ROWS, v);

      end loop;

      return table;

    end function ring_table;

    function base_table return rings_t is

      variable table : rings_t;

    begin

      table := (others => 1);

      for v in 0 to M - 1 loop

        table(v) := 0;

        if ring_lines(M, SHIFTS, CENTRED, ANY_ROWS, v) > 0 then
          table(v) := bank_lines(M, SHIFTS, CENTRED, ANY_ROWS, v);
        end if;

      end loop;

      return table;

    end function base_table;

    -- Lines of a phase that come before the first one that enters, modulo the ring (1 to its size, see table_words).
    function skip_table return places_t is

      variable table : places_t;
      variable index : integer;
      variable ring  : natural;

    begin

      table := (others => 1);

      for s in 0 to SLICES - 1 loop

        for v in 0 to M - 1 loop

          index := initial_index(M, SHIFTS, CENTRED, s, v, false);
          ring  := ring_lines(M, SHIFTS, CENTRED, ANY_ROWS, v);

          if ring > 0 then
            table(s * SLICE_STEP + v) := ring;

            if index >= 0 then
              table(s * SLICE_STEP + v) := index / M mod ring + 1;
            end if;
          end if;

        end loop;

      end loop;

      return table;

    end function skip_table;

    constant RING_OF : rings_t  := ring_table;
    constant BASE_OF : rings_t  := base_table;
    constant SKIP_OF : places_t := skip_table;

    -- A place further on in a ring.
    function moved (
      from_place : ring_t;
      lines      : natural;
      ring       : natural
    ) return ring_t is
    begin

      if ring = 0 then
        return 0;
      elsif from_place + lines >= ring then
        return from_place + lines - ring;
      end if;

      return from_place + lines;

    end function moved;

    function place_before (
      place : ring_t;
      ring  : natural
    ) return ring_t is
    begin

      if place > 0 then
        return place - 1;
      elsif ring > 0 then
        return ring - 1;
      end if;

      return 0;

    end function place_before;

    type line_addresses_t is array (natural range 0 to 2 ** bits_for(ALL_LINES) - 1) of word_address_t;

    -- A table instead of a multiplier.
    function line_table return line_addresses_t is

      variable table : line_addresses_t;

    begin

      table    := (others => (others => '1'));
      table(0) := (others => '0');

      for line in 1 to ALL_LINES - 1 loop

        table(line) := to_unsigned(line * DEPTH, WORD_BITS);

      end loop;

      return table;

    end function line_table;

    constant ADDRESS_OF : line_addresses_t := line_table;

    -- The word that a line of a ring begins with, in its bank.
    function line_address (
      place : ring_t;
      v     : natural
    ) return word_address_t is
    begin

      return ADDRESS_OF(BASE_OF(v) + place / BANKS);

    end function line_address;

    -- Places in the rings, by phase: of the next line that comes in, of the first line of the frame that comes in,
    -- of the next line that enters.
    signal write_place : rings_t := (others => 0);
    signal frame_place : rings_t := (others => 0);
    signal enter_place : rings_t := (others => 0);

    signal taking_2      : std_logic                := '0';
    signal step_3        : std_logic                := '0';
    signal taking_3      : std_logic                := '0';
    signal own_2         : natural range 0 to M - 1 := 0;
    signal own_place_2   : ring_t                   := 0;
    signal live_2        : std_logic                := '0';
    signal own_3         : natural range 0 to M - 1 := 0;
    signal stored_3      : std_logic                := '0';
    signal enters_3      : natural range 0 to M - 1 := 0;
    signal own_place_3   : ring_t                   := 0;
    signal enter_place_3 : ring_t                   := 0;
    signal leave_place_3 : ring_t                   := 0;
    signal first_column  : std_logic_vector(0 downto 0);
    signal first_tag     : std_logic_vector(0 downto 0);
    signal own_line      : word_address_t := (others => '0');
    signal enter_line    : word_address_t := (others => '0');
    signal leave_line    : word_address_t := (others => '0');
    signal own_bank      : natural range 0 to 1 := 0;
    signal enter_bank    : natural range 0 to 1 := 0;
    signal stored_4      : std_logic := '0';
    signal own_bank_5    : natural range 0 to 1 := 0;
    signal enter_bank_5  : natural range 0 to 1 := 0;
    signal enter_bank_6  : natural range 0 to 1 := 0;
    signal enter_bank_7  : natural range 0 to 1 := 0;
    signal enter_bank_8  : natural range 0 to 1 := 0;
    signal stored_5      : std_logic := '0';
    signal write_address : word_address_t := (others => '0');
    signal read_address  : word_addresses_t := (others => (others => '0'));
    signal bank_words    : bank_words_t;

  begin

    -- The column of a token, with the control's outputs.
    first_tag(0) <= step;

    delay_first : entity work.tag_delay
      generic map (
        WIDTH  => 1,
        LENGTH => ADDRESS_CLOCKS - 2
      )
      port map (
        clk     => clk,
        reset   => '0',
        enable  => '1',
        tag     => first_tag,
        delayed => first_column
      );

    slot_in <= (others => '0') when first_column(0) = '1' else
               slot(1) + 1 when order_in.active = '1' else
               slot(1);

    find_lines : process (clk) is

      variable next_own   : ring_t;
      variable next_enter : ring_t;

    begin

      if rising_edge(clk) then
        -- 1: the place of the own line.
        if step_1 = '1' and first_1 = '1' then
          frame_place <= write_place;
        end if;
        own_2       <= phase_1;
        own_place_2 <= write_place(phase_1);
        live_2      <= live_1;
        taking_2    <= take_1;

        -- 2: the line that enters, and the one before it in its ring; with output 0 the places of what enters.
        next_own := moved(own_place_2, 1, RING_OF(own_2));
        step_3   <= step_after;
        stored_3 <= '0';
        if RING_OF(own_2) > 0 then
          stored_3 <= live_2;
        end if;
        if step_after = '1' then
          own_3         <= own_2;
          own_place_3   <= own_place_2;
          enters_3      <= enter_phase_2;
          enter_place_3 <= enter_place(enter_phase_2);
          leave_place_3 <= place_before(enter_place(enter_phase_2), RING_OF(enter_phase_2));
          taking_3      <= taking_2;

          -- No element of varying index: GHDL 2.0 synthesises no register for it.
          for v in 0 to M - 1 loop

            if v = own_2 and live_2 = '1' then
              write_place(v) <= next_own;
            end if;
            if taking_2 = '1' then
              enter_place(v) <= moved(frame_place(v), SKIP_OF(table_row(M, SHIFTS, slice_1, v)), RING_OF(v));
            end if;

          end loop;

        end if;

        -- 3: the next line of that phase will enter.
        next_enter := moved(enter_place_3, 1, RING_OF(enters_3));
        if step_3 = '1' and moves_3 = '1' and taking_3 = '0' then

          for v in 0 to M - 1 loop

            if v = enters_3 then
              enter_place(v) <= next_enter;
            end if;

          end loop;

        end if;

        -- 4: addresses of lines.
        own_line   <= line_address(own_place_3, own_3);
        enter_line <= line_address(enter_place_3, enters_3);
        leave_line <= line_address(leave_place_3, enters_3);
        own_bank   <= own_place_3 mod BANKS;
        enter_bank <= enter_place_3 mod BANKS;
        stored_4   <= stored_3;

        -- 5: addresses of pixels.
        own_bank_5    <= own_bank;
        enter_bank_5  <= enter_bank;
        stored_5      <= stored_4;
        write_address <= own_line + slot(1);

        for b in 0 to BANKS - 1 loop

          if enter_bank = b then
            read_address(b) <= enter_line + slot(1);
          else
            read_address(b) <= leave_line + slot(1);
          end if;

        end loop;

        enter_bank_6 <= enter_bank_5;
        enter_bank_7 <= enter_bank_6;
        enter_bank_8 <= enter_bank_7;
      end if;

    end process find_lines;

    bank : for b in 0 to choose(ALL_LINES = 0, 0, BANKS) - 1 generate

      signal write_enable : std_logic;

    begin

      write_enable <= order(2).active and stored_5 when own_bank_5 = b else
                      '0';

      lines : entity work.ram_blocks
        generic map (
          WIDTH => PIXEL_BITS,
          WORDS => WORDS
        )
        port map (
          clk           => clk,
          write_enable  => write_enable,
          write_address => write_address,
          write_data    => pixels_at(0),
          read_address  => read_address(b),
          read_data     => bank_words(b)
        );

    end generate bank;

    one_bank : if not LEAVING generate
      entering <= bank_words(0);
    end generate one_bank;

    two_banks : if LEAVING generate
      entering <= bank_words(enter_bank_8);
      going    <= bank_words(1 - enter_bank_8);
    end generate two_banks;

  end generate line_memory;

  --------------------------------------------------------------------------------------------------
  -- Sums.

  add : process (clk) is

    variable pixel_in  : unsigned(PRODUCT_BITS - 1 downto 0);
    variable pixel_out : unsigned(PRODUCT_BITS - 1 downto 0);
    variable own       : unsigned(PRODUCT_BITS - 1 downto 0);
    variable sum       : unsigned(SUM_BITS - 1 downto 0);

  begin

    if rising_edge(clk) then

      for i in 0 to LANES - 1 loop

        -- By how much the sums change; the sums of output 0 of the line that comes in.
        own       := lane_of(pixels_at(READ_CLOCKS), i, PRODUCT_BITS);
        pixel_in  := (others => '0');
        pixel_out := (others => '0');
        if order(ADD_CHANGES).enter = '1' then
          if order(ADD_CHANGES).enter_now = '1' then
            pixel_in := own;
          else
            pixel_in := lane_of(entering, i, PRODUCT_BITS);
          end if;
        end if;
        if LEAVING and order(ADD_CHANGES).leave = '1' then
          pixel_out := lane_of(going, i, PRODUCT_BITS);
        end if;
        changes((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(resize(pixel_in, SUM_BITS) -
                                                                                resize(pixel_out, SUM_BITS));

        if order(ADD_CHANGES).active = '1' then
          sum := (others => '0');
          if order(ADD_CHANGES).fresh = '0' then
            sum := lane_of(old_first, i, SUM_BITS);
          end if;
          if order(ADD_CHANGES).to_first = '1' then
            sum := sum + own;
          end if;
          first_sums((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(sum);

          sum := (others => '0');
          if order(ADD_CHANGES).fresh = '0' then
            sum := lane_of(old_held, i, SUM_BITS);
          end if;
          if order(ADD_CHANGES).to_held = '1' then
            sum := sum + own;
          end if;
          held_sums((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(sum);
        end if;

        -- The sums.
        if order(ADD_SUMS).active = '1' then
          sum := (others => '0');
          if order(ADD_SUMS).take = '1' then
            sum := lane_of(first_sums, i, SUM_BITS);
          else
            if LEAVING or order(ADD_SUMS).clear = '0' then
              sum := lane_of(old_sums, i, SUM_BITS);
            end if;
            sum := sum + lane_of(changes, i, SUM_BITS);
          end if;
          sums((i + 1) * SUM_BITS - 1 downto i * SUM_BITS) <= std_logic_vector(sum);
        end if;

      end loop;

      -- Results, the same for a group.
      held_before <= held_sums;
      if order(SHOW).active = '1' then
        if order(SHOW).due = '0' then
          -- No output of a line: whatever the sums hold.
          results <= (others => '0');
        elsif order(SHOW).update = '1' or not HOLDING then
          results <= sums;
        elsif SPLIT and order(SHOW).take = '1' then
          results <= held_before;
        else
          results <= old_results;
        end if;
      end if;
    end if;

  end process add;

  -- Rows: what the registers hold.
  row_sums : if DEPTH = 1 generate
    old_first   <= first_sums;
    old_held    <= held_sums;
    old_sums    <= sums;
    old_results <= results;
  end generate row_sums;

  -- Columns: a word for each.
  column_sums : if DEPTH > 1 generate

    first_sums_of_columns : entity work.ram_simple_dual_port
      generic map (
        WIDTH        => SUMS_BITS,
        ADDRESS_BITS => SLOT_BITS,
        WORDS        => DEPTH,
        READ_LATENCY => 2
      )
      port map (
        clk           => clk,
        write_enable  => order(ADD_SUMS).active,
        write_address => slot(ADD_SUMS),
        write_data    => first_sums,
        read_enable   => '1',
        read_address  => slot(ADD_CHANGES - 2),
        read_data     => old_first
      );

    sums_of_columns : entity work.ram_simple_dual_port
      generic map (
        WIDTH        => SUMS_BITS,
        ADDRESS_BITS => SLOT_BITS,
        WORDS        => DEPTH,
        READ_LATENCY => 2
      )
      port map (
        clk           => clk,
        write_enable  => order(SHOW).active,
        write_address => slot(SHOW),
        write_data    => sums,
        read_enable   => '1',
        read_address  => slot(ADD_CHANGES - 1),
        read_data     => old_sums
      );

    held_results : if HOLDING generate

      results_of_columns : entity work.ram_simple_dual_port
        generic map (
          WIDTH        => SUMS_BITS,
          ADDRESS_BITS => SLOT_BITS,
          WORDS        => DEPTH,
          READ_LATENCY => 2
        )
        port map (
          clk           => clk,
          write_enable  => order(SHOWN).active,
          write_address => slot(SHOWN),
          write_data    => results,
          read_enable   => '1',
          read_address  => slot(ADD_CHANGES),
          read_data     => old_results
        );

    end generate held_results;

    held_first_sums : if SPLIT generate

      held_sums_of_columns : entity work.ram_simple_dual_port
        generic map (
          WIDTH        => SUMS_BITS,
          ADDRESS_BITS => SLOT_BITS,
          WORDS        => DEPTH,
          READ_LATENCY => 2
        )
        port map (
          clk           => clk,
          write_enable  => order(ADD_SUMS).active,
          write_address => slot(ADD_SUMS),
          write_data    => held_sums,
          read_enable   => '1',
          read_address  => slot(ADD_CHANGES - 2),
          read_data     => old_held
        );

    end generate held_first_sums;

  end generate column_sums;

  --------------------------------------------------------------------------------------------------
  -- Side information.

  step       <= strobe and advance;
  step_in(0) <= step;

  delay_step : entity work.tag_delay
    generic map (
      WIDTH  => 1,
      LENGTH => 2
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => step_in,
      delayed => step_2
    );

  delay_step_tag : entity work.tag_delay
    generic map (
      WIDTH  => STEP_TAG_BITS,
      LENGTH => 2
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => step_tag,
      delayed => step_tag_2
    );

  step_tags : entity work.tag_delay
    generic map (
      WIDTH  => STEP_TAG_BITS,
      LENGTH => DELAY + 1
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => step_2(0),
      tag     => step_tag_2,
      delayed => step_tag_due
    );

  later_step_tags : entity work.tag_delay
    generic map (
      WIDTH  => STEP_TAG_BITS,
      LENGTH => LATENCY - 3
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => step_tag_due,
      delayed => out_step_tag
    );

  strobe_in(0) <= strobe;

  strobes : entity work.tag_delay
    generic map (
      WIDTH  => 1,
      LENGTH => LATENCY
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => strobe_in,
      delayed => strobe_due
    );

  out_strobe <= strobe_due(0);

  token_tags : entity work.tag_delay
    generic map (
      WIDTH  => TOKEN_TAG_BITS,
      LENGTH => LATENCY
    )
    port map (
      clk     => clk,
      reset   => reset,
      enable  => '1',
      tag     => token_tag,
      delayed => out_token_tag
    );

end architecture rtl;
