-- SPDX-License-Identifier: Apache-2.0
-- Records between i2c_master and the entities that give it orders.

library ieee;
use ieee.std_logic_1164.all;

package i2c_pkg is

  -- What comes next on the lines; at most one of the first four bits is high.
  type i2c_order_t is record
    -- A start, which is a repeated one behind a byte; a stop; a byte to the device; a byte from the device.
    start   : std_logic;
    stop    : std_logic;
    send    : std_logic;
    receive : std_logic;
    -- The byte to be sent. more: the byte from the device is acknowledged, because a further one is wanted; behind a
    -- stop the clock line falls at once, because a further order follows.
    value : std_logic_vector(7 downto 0);
    more  : std_logic;
  end record i2c_order_t;

  -- What became of an order.
  type i2c_result_t is record
    -- Each high for one clock: the order is carried out; the clock line stayed low, and both lines are released.
    over  : std_logic;
    stuck : std_logic;
    -- The data line: with over its present level; of the last byte the bits and, at the right, the acknowledge bit.
    level : std_logic;
    bits  : std_logic_vector(8 downto 0);
    -- With over: a bit of the byte was sent and another level was on the line. The rest of the byte was not sent.
    disturbed : std_logic;
  end record i2c_result_t;

end package i2c_pkg;
