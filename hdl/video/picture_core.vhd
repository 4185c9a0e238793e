-- SPDX-License-Identifier: Apache-2.0
-- From a stream of raw pixels to the stream of the picture that is shown: refocused, all in focus, or depth.
--
-- If only the refocused slice is shown, this is the core of a raster_refocuser. With other outputs it is that of a
-- focal_stack with its depth index, and each output frame shows one of these: the chosen slice, the sharpest slice of
-- each micro image, or a colour for that slice or for the depth between slices. The slice is chosen with a frame's
-- first input pixel, the output with its first output pixel. The stack does not push the rest of a frame out by itself;
-- the next frame does. Its frames have a multiple of M lines: black lines below the picture do not come out.
--
-- Latency: picture_delay_lines lines and picture_delay_pixels pixels of video. Throughput: one pixel each clock.
-- Equation: that of raster_refocuser, focal_stack or sharpness_index; depth(k) = colour number index(k) of COLOURS,
-- with depth between slices number 8 index(k) + floor(fraction(k) / 32).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library work;
use work.math_pkg.all;
use work.fault_pkg.all;
use work.core_pkg.all;
use work.index_pkg.all;
use work.token_pkg.all;
use work.picture_pkg.all;
use work.video_pkg.all;

entity picture_core is
  generic (
    -- The core of the picture, made for its other generics (picture_core_of).
    CORE : core_t;
    -- The outputs that can be shown (picture_pkg).
    OUTPUTS : string := "r";
    -- How the sharpest slice is found (depth_index).
    RADIUS      : natural range 0 to 8          := 1;
    CONFIDENCE  : natural range 0 to 1073741823 := 0;
    VOTE_RADIUS : natural range 0 to 4          := 0;
    -- If depth can be shown: a colour for each slice, six hexadecimal digits (red, green, blue); or eight colours for
    -- each slice, from the middle between it and the slice before to the middle between it and the slice behind.
    COLOURS : string := ""
  );
  port (
    clk   : in    std_logic;
    reset : in    std_logic;
    -- Frame size, read with the first pixel of a frame; with outputs other than "r" a multiple of M lines.
    columns : in    std_logic_vector(15 downto 0);
    rows    : in    std_logic_vector(15 downto 0);
    -- Lines of the picture; with "r" alone all lines.
    picture_rows : in    std_logic_vector(15 downto 0);
    -- What is shown: the slice is read with the first pixel of a frame that comes in, the output with the first pixel
    -- of a frame that leaves.
    choice : in    picture_choice_t;
    -- The raster of micro images.
    s_axis        : in    stream_t;
    s_axis_tready : out   std_logic;
    -- The picture; tid: its slice; tdest: the place in OUTPUTS of what it shows.
    m_axis        : out   stream_t;
    m_axis_tready : in    std_logic;
    m_axis_tid    : out   std_logic_vector(7 downto 0);
    m_axis_tdest  : out   std_logic_vector(1 downto 0);
    -- Faults of the stream in, by the bits of fault_pkg; bits stay set until error_clear.
    error_flags : out   std_logic_vector(STREAM_FAULT_BITS - 1 downto 0);
    error_clear : in    std_logic := '1'
  );
end entity picture_core;

architecture rtl of picture_core is

  constant M        : positive := CORE.geometry.micro_image_size;
  constant SLICES   : positive := slices_of(CORE);
  constant CHANNELS : positive := CORE.channels;

  signal order   : frame_order_t;
  signal s_marks : marks_t;

begin

  order   <=
  (
    columns      => columns,
    rows         => rows,
    slice        => choice.slice,
    sweep        => choice.sweep,
    sweep_frames => choice.sweep_frames
  );
  s_marks <= (s_axis.tvalid, s_axis.tuser, s_axis.tlast);

  one_slice : if CORE.engine /= stack generate

    signal refocused : std_logic_vector(row_bits(CORE) - 1 downto 0);
    signal m_marks   : marks_t;

  begin

    -- There is only one output.
    m_axis_tdest <= "00";

    -- A grey core gives one channel, which all three channels show.
    all_channels : for i in 0 to 2 generate
      m_axis.tdata(8 * i + 7 downto 8 * i) <= refocused(8 * (i mod CHANNELS) + 7 downto 8 * (i mod CHANNELS));
    end generate all_channels;

    slice_core : entity work.refocuser
      generic map (
        CORE => CORE
      )
      port map (
        clk           => clk,
        reset         => reset,
        order         => order,
        s_axis_marks  => s_marks,
        s_axis_tready => s_axis_tready,
        s_axis_tdata  => s_axis.tdata(row_bits(CORE) - 1 downto 0),
        m_axis_marks  => m_marks,
        m_axis_tready => m_axis_tready,
        m_axis_tdata  => refocused,
        m_axis_tid    => m_axis_tid,
        error_flags   => error_flags,
        error_clear   => error_clear
      );

    m_axis.tvalid <= m_marks.tvalid;
    m_axis.tuser  <= m_marks.tuser;
    m_axis.tlast  <= m_marks.tlast;

  end generate one_slice;

  all_slices : if CORE.engine = stack generate

    -- Several colours for each slice need the depth between slices.
    constant OWN_SHADES : positive      := shades(SLICES, COLOURS);
    constant BETWEEN    : boolean       := OWN_SHADES > 1;
    constant INDEX      : index_build_t := picture_index("picture_core", CORE, BETWEEN, RADIUS, CONFIDENCE,
                                                         VOTE_RADIUS);

    -- A pixel's data: pixel of the sharpest slice, index, depth between slices, pixel of the chosen slice.
    constant FOUND_BITS : positive := out_bits(INDEX);

    -- Colours: one for each index, or eight for the intervals beside it.
    constant COLOUR_COUNT : positive := SLICES * OWN_SHADES;
    constant COLOUR_BITS  : positive := bits_for(COLOUR_COUNT - 1);

    type colours_t is array (natural range 0 to 2 ** COLOUR_BITS - 1) of pixel_t;

    -- The table of colours; all black if depth cannot be shown.

    function make_colours return colours_t is

      -- The table is as long as its address allows, so that every index is valid.
      variable made : colours_t;

    begin

      made := (others => (others => '0'));

      if COLOURS'length >= 6 * COLOUR_COUNT then

        for s in 0 to SLICES - 1 loop

          -- The loop has a constant length; the condition leaves out colours that do not exist.
          for i in 0 to MOST_SHADES - 1 loop

            if i < OWN_SHADES then
              made(s * OWN_SHADES + i) := colour_at(COLOURS, s * OWN_SHADES + i);
            end if;

          end loop;

        end loop;

      end if;

      return made;

    end function make_colours;

    constant TABLE : colours_t := make_colours;

    constant KINDS : kinds_t   := output_kinds(OUTPUTS);

    -- The stack of slices on its way to the depth index, the order and the output of the index, and faults of both.
    signal stack_marks  : marks_t;
    signal stack_ready  : std_logic;
    signal stack_data   : std_logic_vector(result_bits(CORE) - 1 downto 0);
    signal stack_id     : std_logic_vector(7 downto 0);
    signal index_order  : frame_order_t;
    signal found_marks  : marks_t;
    signal found_shade  : unsigned(COLOUR_BITS - 1 downto 0);
    signal found        : std_logic_vector(FOUND_BITS - 1 downto 0);
    signal stack_errors : std_logic_vector(STREAM_FAULT_BITS - 1 downto 0);
    signal index_errors : std_logic_vector(STREAM_FAULT_BITS - 1 downto 0);
    -- The output that the present frame shows, and that of the pixel before.
    signal shown_now  : std_logic_vector(1 downto 0);
    signal shown_held : std_logic_vector(1 downto 0) := "00";
    signal waits      : std_logic                    := '0';

  begin

    -- The input FIFO holds the pixels that arrive while lines that waited for this frame leave.
    stack_core : entity work.refocuser
      generic map (
        CORE        => CORE,
        INPUT_LINES => M,
        FLUSH       => false
      )
      port map (
        clk           => clk,
        reset         => reset,
        order         => order,
        s_axis_marks  => s_marks,
        s_axis_tready => s_axis_tready,
        s_axis_tdata  => s_axis.tdata,
        m_axis_marks  => stack_marks,
        m_axis_tready => stack_ready,
        m_axis_tdata  => stack_data,
        m_axis_tid    => stack_id,
        error_flags   => stack_errors,
        error_clear   => error_clear
      );

    index_order <=
    (
      columns      => columns,
      rows         => rows,
      slice        => stack_id,
      sweep        => '0',
      sweep_frames => x"00"
    );

    -- The index is computed whatever is shown, so all outputs have one delay, and a new choice tears no picture.
    find : entity work.stack_index
      generic map (
        BUILD => INDEX
      )
      port map (
        clk           => clk,
        reset         => reset,
        order         => index_order,
        picture_rows  => picture_rows,
        s_axis_marks  => stack_marks,
        s_axis_tready => stack_ready,
        s_axis_tdata  => stack_data,
        m_axis_marks  => found_marks,
        m_axis_tready => m_axis_tready,
        m_axis_tdata  => found,
        m_axis_tid    => m_axis_tid,
        error_flags   => index_errors,
        error_clear   => error_clear
      );

    -- Both entities see the same frames, so either may report a fault.
    error_flags <= stack_errors or index_errors;

    -- A frame keeps the output that it showed with its first pixel. A pixel on offer, also the first one, stays
    -- unchanged until it is taken, as AXI4-Stream requires.
    shown_now <= shown_held when found_marks.tuser = "0" or waits = '1' else
                 choice.shown when unsigned(choice.shown) < OUTPUTS'length else
                 "00";

    hold_output : process (clk) is
    begin

      if rising_edge(clk) then
        if found_marks.tvalid = '1' then
          shown_held <= shown_now;
        end if;
        waits <= found_marks.tvalid and not m_axis_tready;
        if reset = '1' then
          waits <= '0';
        end if;
      end if;

    end process hold_output;

    -- The colour's address is the index of the slice, followed by the eighth of the interval to its neighbours.
    found_shade <= resize(unsigned(found(31 downto 24)) & unsigned(found(39 downto 37)), COLOUR_BITS) when BETWEEN else
                   resize(unsigned(found(31 downto 24)), COLOUR_BITS);

    pick : process (found, found_shade, shown_now) is
    begin

      -- All in focus, depth, or the chosen slice.
      case KINDS(to_integer(unsigned(shown_now))) is

        when 1 =>

          m_axis.tdata <= found(23 downto 0);

        when 2 =>

          m_axis.tdata <= TABLE(to_integer(found_shade));

        when others =>

          m_axis.tdata <= found(FOUND_BITS - 1 downto FOUND_BITS - 24);

      end case;

    end process pick;

    m_axis.tvalid <= found_marks.tvalid;
    m_axis.tuser  <= found_marks.tuser;
    m_axis.tlast  <= found_marks.tlast;
    m_axis_tdest  <= shown_now;

  end generate all_slices;

end architecture rtl;
