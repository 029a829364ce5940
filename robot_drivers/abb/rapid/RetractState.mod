MODULE RetractState
    ! Task T_STATE: sends pose, joints and status about 80 times a second. It influences nothing.

    LOCAL CONST num PERIOD:=0.012;
    LOCAL CONST num CARRY_OVER:=60;

    LOCAL VAR socketdev listener;
    LOCAL VAR socketdev client;
    LOCAL VAR string clientAddress;
    LOCAL VAR dnum messageNumber;

    ! A num resolves 24 bits, so a clock that runs for hours loses its microseconds. Each minute the time is
    ! carried over; the other clock is started before this one is read, so that none is lost.
    LOCAL VAR clock evenClock;
    LOCAL VAR clock oddClock;
    LOCAL VAR bool evenRuns:=TRUE;
    LOCAL VAR dnum carriedTime:=0;

    PROC main()
        carriedTime:=0;
        evenRuns:=TRUE;
        ClkStop evenClock;
        ClkReset evenClock;
        ClkStart evenClock;
        rtListen listener,RT_STATE_PORT;
        WHILE TRUE DO
            SocketClose client;
            SocketAccept listener,client\ClientAddress:=clientAddress\Time:=WAIT_MAX;
            messageNumber:=0;
            IF clientAddress=RT_CLIENT_IP SendStates;
        ENDWHILE
    ERROR
        SkipWarn;
        WaitTime 1;
        ExitCycle;
    ENDPROC

    LOCAL PROC SendStates()
        WHILE TRUE DO
            SendState;
            messageNumber:=messageNumber+1;
            WaitTime PERIOD;
        ENDWHILE
    ERROR
        ! The client has gone; main waits for the next one
        IF ERRNO=ERR_SOCK_CLOSED OR ERRNO=ERR_SOCK_TIMEOUT THEN
            SkipWarn;
            RETURN;
        ENDIF
        RAISE;
    ENDPROC

    LOCAL PROC SendState()
        VAR rawbytes frame;
        VAR dnum now;
        VAR dnum seconds;
        now:=ControllerTime();
        seconds:=TruncDnum(now);
        rtPackHeader frame,RT_STATE_BYTES,messageNumber,STATE_FRAME;
        PackRawBytes seconds,frame,17\IntX:=UDINT;
        PackRawBytes RoundDnum((now-seconds)*1000000),frame,21\IntX:=UDINT;
        rtPackRobot frame,25;
        PackRawBytes rtMoveSeq,frame,77\IntX:=UDINT;
        SocketSend client\RawData:=frame;
    ENDPROC

    ! Seconds since this task started
    LOCAL FUNC dnum ControllerTime()
        VAR num elapsed;
        IF evenRuns THEN
            elapsed:=ClkRead(evenClock\HighRes);
        ELSE
            elapsed:=ClkRead(oddClock\HighRes);
        ENDIF
        IF elapsed<CARRY_OVER RETURN carriedTime+NumToDnum(elapsed);
        IF evenRuns THEN
            ClkReset oddClock;
            ClkStart oddClock;
            elapsed:=ClkRead(evenClock\HighRes);
            ClkStop evenClock;
        ELSE
            ClkReset evenClock;
            ClkStart evenClock;
            elapsed:=ClkRead(oddClock\HighRes);
            ClkStop oddClock;
        ENDIF
        evenRuns:=NOT evenRuns;
        carriedTime:=carriedTime+NumToDnum(elapsed);
        RETURN carriedTime;
    ENDFUNC
ENDMODULE
