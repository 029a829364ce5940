MODULE RetractEgm
    ! Task T_ROB1, option EGM (RobotWare 6.07 or later): streams measured and planned pose to the PC.
    ! The PC only listens; nothing it sends moves the arm.

    ! Name of the UDPUC device
    LOCAL CONST string DEVICE:="UCdevice";
    LOCAL CONST pose IDENTITY:=[[0,0,0],[1,0,0,0]];

    LOCAL VAR egmident stream;

    PROC RetractEgmStart()
        EGMReset stream;
        EGMGetId stream;
        EGMSetupUC ROB_1,stream,"default",DEVICE\Pose;
        ! Names the tool and work object of the poses and starts the stream; guidance is never run
        EGMActPose stream\StreamStart\Tool:=rtTool\WObj:=rtWobj,
            IDENTITY,EGM_FRAME_WOBJ,IDENTITY,EGM_FRAME_WOBJ\SampleRate:=4;
    ENDPROC
ENDMODULE
