-- SPDX-License-Identifier: Apache-2.0
-- The CrossLink-NX evaluation board from the wires of a camera to its parallel video.
--
-- Packets of input.bin (dphy_camera); pixels go to output.bin, a word of 32 bits each, -1 before each frame.

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;

library lifcl;
use lifcl.model_control.all;

library work;
use work.camera_pkg.all;

entity lifcl40_bench is
  generic (
    MICRO_IMAGE_SIZE    : positive;
    SHIFTS              : string;
    INTERPOLATION_ORDER : natural  := 0;
    HOLD                : boolean  := false;
    MAX_COLUMNS         : positive;
    EXACT               : boolean  := true;
    FRACTION_BITS       : natural  := 0;
    GUARD_BITS          : natural  := 0;
    BROADCAST_TAPS      : natural  := 0;
    ENGINE              : string;
    BOX                 : string   := "";
    PIXELS_PER_CLOCK    : positive := 1;
    ROWS                : positive := 480;
    CLOCK_DIVIDE        : positive := 3;
    SLICE               : natural;
    BIT_PS              : positive;
    CONTINUOUS          : boolean;
    SKEW                : natural;
    PIXELS              : positive
  );
end entity lifcl40_bench;

architecture test of lifcl40_bench is

  type words_t is file of integer;

  constant WIDTH : positive := CAMERA_CHANNELS * RAW_BITS;

  signal begun       : boolean   := false;
  signal sent        : boolean;
  signal reset_n     : std_logic := '0';
  signal clk_p       : std_logic;
  signal clk_n       : std_logic;
  signal data_p      : std_logic_vector(3 downto 0);
  signal data_n      : std_logic_vector(3 downto 0);
  signal scl         : std_logic;
  signal sda         : std_logic;
  signal slice_port  : std_logic_vector(7 downto 0);
  signal out_clk     : std_logic;
  signal frame_valid : std_logic;
  signal line_valid  : std_logic;
  signal data        : std_logic_vector(39 downto 0);
  signal led_n       : std_logic_vector(4 downto 0);

begin

  reset_n <= '1' after 200 ns;
  -- By then the calibration is in.
  begun      <= true after 60 us;
  slice_port <= std_logic_vector(to_unsigned(SLICE, 8));
  scl        <= 'H';
  sda        <= 'H';

  camera : entity work.dphy_camera
    generic map (
      LANES      => CAMERA_LANES,
      BIT_PS     => BIT_PS,
      CONTINUOUS => CONTINUOUS,
      SKEW       => SKEW
    )
    port map (
      start  => begun,
      clk_p  => clk_p,
      clk_n  => clk_n,
      data_p => data_p,
      data_n => data_n,
      sent   => sent
    );

  board : entity work.lifcl40_top
    generic map (
      MICRO_IMAGE_SIZE    => MICRO_IMAGE_SIZE,
      SHIFTS              => SHIFTS,
      INTERPOLATION_ORDER => INTERPOLATION_ORDER,
      HOLD                => HOLD,
      MAX_COLUMNS         => MAX_COLUMNS,
      EXACT               => EXACT,
      FRACTION_BITS       => FRACTION_BITS,
      GUARD_BITS          => GUARD_BITS,
      BROADCAST_TAPS      => BROADCAST_TAPS,
      ENGINE              => ENGINE,
      BOX                 => BOX,
      PIXELS_PER_CLOCK    => PIXELS_PER_CLOCK,
      ROWS                => ROWS,
      CLOCK_DIVIDE        => CLOCK_DIVIDE,
      MILLISECOND         => 1000
    )
    port map (
      reset_n         => reset_n,
      cam_clk_p       => clk_p,
      cam_clk_n       => clk_n,
      cam_data_p      => data_p,
      cam_data_n      => data_n,
      cam_scl         => scl,
      cam_sda         => sda,
      cam_reset_n     => open,
      uart_rx         => '1',
      uart_tx         => open,
      slice           => slice_port,
      out_clk         => out_clk,
      out_frame_valid => frame_valid,
      out_line_valid  => line_valid,
      out_data        => data,
      led_n           => led_n
    );

  take : process (out_clk) is

    file output_file : words_t open write_mode is "output.bin";

    variable received : natural   := 0;
    variable idle     : natural   := 0;
    variable valid    : std_logic := '0';

  begin

    -- In the falling edge, where the board says that nothing else changes.
    if falling_edge(out_clk) then
      idle := idle + 1;
      if frame_valid = '1' and valid = '0' then
        write(output_file, -1);
      end if;
      valid := frame_valid;
      if line_valid = '1' then

        for p in 0 to PIXELS_PER_CLOCK - 1 loop

          write(output_file, to_integer(unsigned(data((p + 1) * WIDTH - 1 downto p * WIDTH))));

        end loop;

        received := received + PIXELS_PER_CLOCK;
        idle     := 0;
      end if;
      -- While the camera sends, nothing hangs.
      if not sent then
        idle := 0;
      end if;
      if (received = PIXELS and idle = 3000) or idle = 20000 then
        assert led_n(4 downto 3) = "11"
          report "the board tells a fault (0): lanes " & std_logic'image(led_n(3)) & ", raster or core " &
                 std_logic'image(led_n(4))
          severity failure;

        stopped <= true;
      end if;
    end if;

  end process take;

end architecture test;
