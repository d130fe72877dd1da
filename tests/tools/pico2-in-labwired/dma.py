"""The DMA controller of an RP2350 (data sheet, 12.6), as far as the transmitter uses it, over labwired's registers.

labwired reads the control registers by the RP2040's layout and paces no channel; what the program writes, it keeps.
"""

DMA, CHANNEL_BYTES, CHANNELS = 0x50000000, 0x40, 16
READ_ADDRESS, WRITE_ADDRESS, COUNT, CONTROL = 0, 4, 8, 12
READ_ADDRESS_TRIGGER = 0x3C
ENABLE_OF_INTERRUPT_1, INTERRUPT_1 = DMA + 0x414, 11
SPI0_DATA = 0x40080008
PWM_SLICE_0, PWM_WRAPPED = 0x400A8000, 0x400A80A4
PACED_BY_SPI0, PACED_BY_SLICE_0, UNPACED = 24, 32, 0x3F
ENABLED = 1
LOAD = 2


class Dma:
    def __init__(self, chip):
        self.chip = chip
        # The transfers that are left, of the channels that are busy.
        self.left = {}
        # All bytes for the LEDs' shift registers.
        self.shifted = bytearray()

    def step(self):
        """Moves what a wrap of slice 0 lets move."""
        if not self.chip.read(PWM_WRAPPED) & 1:
            return
        self.chip.write(PWM_WRAPPED, 1)
        if not self.left and self.chip.read(PWM_SLICE_0) & ENABLED:
            # The program has triggered it in a register that labwired does not have.
            self.trigger(LOAD)
        for channel in [channel for channel in self.left if self.pace(channel) == PACED_BY_SLICE_0]:
            self.move(channel)

    def register(self, channel, register):
        return self.chip.read(DMA + CHANNEL_BYTES * channel + register)

    def pace(self, channel):
        return self.register(channel, CONTROL) >> 17 & 0x3F

    def trigger(self, channel):
        if not self.register(channel, CONTROL) & ENABLED:
            return
        self.left[channel] = self.register(channel, COUNT)
        # The SPI controller has sent all when it is asked again.
        while channel in self.left and self.pace(channel) in (PACED_BY_SPI0, UNPACED):
            self.move(channel)

    def move(self, channel):
        control = self.register(channel, CONTROL)
        size = 1 << (control >> 2 & 3)
        source, target = self.register(channel, READ_ADDRESS), self.register(channel, WRITE_ADDRESS)
        value = int.from_bytes(self.chip.memory(source, size), "little")
        if control >> 4 & 1:
            ring = (1 << (control >> 8 & 15)) - 1
            after = source + size if ring == 0 else source & ~ring | source + size & ring
            self.chip.write(DMA + CHANNEL_BYTES * channel + READ_ADDRESS, after)
        self.left[channel] -= 1
        ended = self.left[channel] == 0
        if ended:
            del self.left[channel]
        self.write(target, value)
        if ended:
            if self.chip.read(ENABLE_OF_INTERRUPT_1) >> channel & 1:
                self.chip.interrupt(INTERRUPT_1)
            following = control >> 13 & 15
            if following != channel:
                self.trigger(following)

    def write(self, address, value):
        channel, register = divmod(address - DMA, CHANNEL_BYTES)
        if address == SPI0_DATA:
            self.shifted.append(value)
        elif 0 <= channel < CHANNELS and register == READ_ADDRESS_TRIGGER:
            self.chip.write(DMA + CHANNEL_BYTES * channel + READ_ADDRESS, value)
            self.trigger(channel)
        else:
            raise ValueError(f"a transfer to {address:#x}, which no program here makes")
