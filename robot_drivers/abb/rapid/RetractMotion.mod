MODULE RetractMotion
    ! Task T_ROB1: carries out one straight line at a time, to a stop point, and nothing else.
    ! It decides nothing: RetractComm has checked the target before it hands it over.

    LOCAL VAR intnum abortOrder;

    PROC main()
        IDelete abortOrder;
        CONNECT abortOrder WITH ForgetPath;
        IPers rtAbortCount,abortOrder;
        rtMovePending:=FALSE;
        SetUpMotion;
        StartEgmStream;
        rtMoveBusy:=FALSE;
        WHILE TRUE DO
            WaitUntil rtMovePending\PollRate:=0.008;
            rtMovePending:=FALSE;
            MoveToTarget;
            rtMoveBusy:=FALSE;
        ENDWHILE
    ENDPROC

    LOCAL PROC SetUpMotion()
        ! A change of configuration on a line is an error, never a swing of the arm
        ConfL\On;
        SingArea\Off;
        AccSet RT_ACCELERATION,RT_ACCELERATION;
        ! Whatever speed is asked for, the tool stays below this
        VelSet 100,RT_MAX_SPEED;
    ENDPROC

    LOCAL PROC MoveToTarget()
        MoveL rtTarget,rtSpeed,fine,rtTool\WObj:=rtWobj;
        WaitRob\ZeroSpeed;
        WaitTime RT_SETTLE_TIME;
        rtArrived:=TRUE;
    ERROR
        ! No RETRY of a motion: the rest of the path is forgotten, T_COMM tells the PC
        rtMoveErrno:=ERRNO;
        StopMove;
        ClearPath;
        StartMove;
        RETURN;
    ENDPROC

    ! T_COMM has ordered StopMove before; only T_COMM orders StartMove, on RESUME.
    LOCAL TRAP ForgetPath
        WaitRob\ZeroSpeed;
        ClearPath;
        ExitCycle;
    ENDTRAP

    ! The module RetractEgm is loaded only on controllers with the option EGM
    LOCAL PROC StartEgmStream()
        %"RetractEgmStart"%;
    ERROR
        IF ERRNO=ERR_REFUNKPRC THEN
            SkipWarn;
            TRYNEXT;
        ENDIF
        RAISE;
    ENDPROC
ENDMODULE
